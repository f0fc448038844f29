"""Does the judge schedule as ARCHITECTURE.md says, and does the front door see what it is there for? The schedules here are worked out
by hand; runs are spoiled, sets are dishonest, findings are shrunk. No program is started."""

import random
import unittest

import front_door
import generator
import judge
import minimise
import sets
import writer

MS = sets.MS


def loop(number, budget, period, *scripts, core=0, sleep=0):
    return sets.Loop(number, budget * MS, period * MS, core, sleep * MS, list(scripts) or [[("c", budget)]])


def world(the_set, deferrable=(), answers=None):
    cores = {each.id: each.core for each in the_set.loops}
    asked = [each for each in (*the_set.services, *the_set.edges) if each.budget]
    cores |= {judge.FIRST_IO + place: each.core for place, each in enumerate(asked)}
    return judge.World(the_set, cores, set(deferrable), answers or {}).run(the_set.length)


def milliseconds(releases, count):
    return [(one.begin / MS, one.end / MS) for one in releases[:count]]


def made(**parts):
    return sets.Set(step_ns=MS, length=100 * MS, **parts)


class Schedules(unittest.TestCase):
    def test_the_shorter_period_goes_first(self):
        seen = world(made(loops=[loop(1, 3, 10), loop(2, 10, 20)]))
        self.assertEqual(milliseconds(seen.releases[1], 2), [(0, 3), (10, 13)])
        self.assertEqual(milliseconds(seen.releases[2], 1), [(3, 16)])

    def test_a_chunk_is_back_one_period_after_it_became_active(self):
        # The picture in sporadic_server.h: 1 is used at 0, 2 at 4. Work of t = 7 waits for 10.
        server = judge.Sporadic(3, 10)
        server.wake(0)
        server.use(1, 1)
        server.block(1)
        server.wake(4)
        server.use(6, 2)
        self.assertEqual(server.chunks, [[10, 1], [14, 2]])
        self.assertEqual((server.left(7), server.left(10), server.back()), (0, 1, 10))

    def test_an_interrupt_at_a_release_leaves_no_trace_in_later_ones(self):
        late_once = made(loops=[loop(1, 5, 10)], interrupts=[sets.Interrupt("nic", 30 * MS, 0, 3 * MS, 0, 0)])
        seen = world(late_once)
        self.assertEqual(milliseconds(seen.releases[1], 5), [(0, 5), (10, 15), (20, 25), (33, 38), (40, 45)])

    def test_a_deferrable_budget_is_whole_at_each_release(self):
        sleeper = loop(1, 3, 10, [("s", 7 * MS), ("c", 3)], [("c", 3)], sleep=7)
        self.assertEqual(milliseconds(world(made(loops=[sleeper]), {1}).releases[1], 2), [(0, 10), (10, 13)])
        self.assertEqual(milliseconds(world(made(loops=[sleeper])).releases[1], 2), [(0, 10), (10, 20)])

    def test_a_loop_beyond_its_budget_is_throttled_and_drops_a_release(self):
        seen = world(made(loops=[loop(1, 3, 10, [("c", 5)])]))
        self.assertEqual([(one.nominal / MS, one.end / MS) for one in seen.releases[1][:2]], [(0, 12), (20, 32)])
        self.assertGreater(seen.late[1], 0)

    def test_a_waiter_lends_its_rank_and_is_handed_the_lock(self):
        low = loop(3, 6, 50, [("l", 0), ("c", 6), ("u", 0)])
        mid = loop(2, 4, 20, [("s", MS), ("c", 4)], sleep=1)
        high = loop(1, 2, 10, [("s", 2 * MS), ("l", 0), ("c", 1), ("u", 0), ("c", 1)], sleep=2)
        seen = world(made(loops=[high, mid, low], locks={0: {}}), {1, 2})
        # Low 0–1, mid 1–2; high asks at 2, and low computes its other 5 ms at high's rank.
        self.assertEqual(milliseconds(seen.releases[3], 1), [(0, 7)])
        self.assertEqual(milliseconds(seen.releases[1], 1), [(0, 9)])
        self.assertEqual(milliseconds(seen.releases[2], 1), [(0, 12)])

    def test_a_waiter_pays_for_a_holder_without_budget(self):
        low = loop(2, 2, 20, [("l", 0), ("c", 3), ("u", 0)])
        high = loop(1, 4, 10, [("s", MS), ("l", 0), ("c", 1), ("u", 0)], sleep=1)
        seen = world(made(loops=[high, low], locks={0: {}}), {1})
        self.assertEqual(milliseconds(seen.releases[2], 1), [(0, 3)])
        self.assertEqual(milliseconds(seen.releases[1], 1), [(0, 4)])

    def test_a_bottom_half_gets_its_share_at_its_clients_rank(self):
        # U = 1/10 of 10 ms is 1 ms: of 2 ms of work the second comes 10 ms later.
        edge = sets.Edge(5, 2 * MS, 20 * MS, 0, [[("c", 2)]])
        seen = world(made(loops=[loop(1, 2, 10, [("p", 5), ("c", 2)], [("c", 2)], [("c", 2)])], edges=[edge]))
        self.assertEqual([(begin / MS, end / MS) for begin, end in seen.runs[5][:1]], [(2, 13)])

    def test_a_budget_that_is_raised_counts_from_the_next_service(self):
        edge = sets.Edge(5, 0, 1, 0, [[("c", 2)]])
        raise_it = [("c", 2), ("b", "gpio", 2 * MS, 10 * MS)]
        two = made(loops=[loop(1, 3, 10, [("p", 5), *raise_it], [("c", 2)])], edges=[edge], services=[sets.Service("gpio", MS, 10 * MS, 0)])
        self.assertEqual(world(two, answers={1: [True] * 9}).runs[5][0], (2 * MS, 4 * MS))
        self.assertEqual(world(two).runs[5][0], (2 * MS, 13 * MS))

    def test_interrupts_that_are_routed_away_come_to_the_lowest_core_left(self):
        both = made(cores=2, loops=[loop(1, 2, 10, [("c", 2), ("a", "nic", 0)], [("c", 2)]), loop(2, 2, 10, core=1)],
                    interrupts=[sets.Interrupt("nic", 10 * MS, 0, MS, 0, 0)])
        seen = world(both, answers={1: [True]})
        self.assertEqual(milliseconds(seen.releases[1], 2), [(0, 2), (10, 12)])
        self.assertEqual(milliseconds(seen.releases[2], 2), [(0, 2), (11, 13)])

    def test_turning_to_a_vcpu_takes_time(self):
        seen = world(made(switch=MS, loops=[loop(1, 2, 10), loop(2, 5, 30)]))
        self.assertEqual(milliseconds(seen.releases[1], 1), [(1, 3)])
        self.assertEqual(milliseconds(seen.releases[2], 1), [(4, 9)])
        # The first one counts its releases from when it came up.
        self.assertEqual(milliseconds(seen.releases[1], 2)[1], (12, 14))

    def test_a_sleeper_wakes_late(self):
        seen = world(made(wake_latency=MS, loops=[loop(1, 3, 20, [("c", 1), ("s", 5 * MS), ("c", 2)], sleep=5)]))
        self.assertEqual(milliseconds(seen.releases[1], 2), [(0, 9), (21, 30)])

    def test_an_edge_takes_time_of_the_core_of_its_handler(self):
        # What loop 1 writes at 0, 3 and 6 stops it for 1 ms each time; its handler ranks below it.
        edge = sets.Edge(5, MS, 10 * MS, 0, [[("c", 1)]])
        three = [("p", 5), ("c", 2), ("p", 5), ("c", 2), ("p", 5), ("c", 2)]
        seen = world(made(edge_top=MS, edge_interval=MS, loops=[loop(1, 6, 40, three)], edges=[edge]))
        self.assertEqual(milliseconds(seen.releases[1], 1), [(0, 9)])
        self.assertEqual(seen.runs[5][0], (9 * MS, 10 * MS))

    def test_an_edge_that_comes_too_soon_is_held_back_and_of_several_one(self):
        edge = sets.Edge(5, MS, 10 * MS, 1, [[("c", 1)]])
        seen = world(made(cores=2, edge_top=MS, edge_interval=8 * MS, edges=[edge], loops=[
            loop(1, 6, 40, [("p", 5), ("c", 2), ("p", 5), ("c", 2), ("p", 5), ("c", 2)]), loop(2, 2, 20, core=1)]))
        # At 0 and, held back, at 8: their top halves end at 1 and 9. The first service could run
        # from 1, and is paid back at 11.
        self.assertEqual(milliseconds(seen.releases[2], 1), [(1, 3)])
        self.assertEqual([(begin / MS, end / MS) for begin, end in seen.runs[5][:3]], [(3, 4), (11, 12), (43, 44)])

    def test_a_budget_that_pays_for_an_interrupt_has_so_much_more(self):
        paying = made(victim_pays=True, loops=[loop(1, 5, 10, [("c", 5)])], interrupts=[sets.Interrupt("nic", 12 * MS, 0, 2 * MS, 0, 0)])
        cores = {1: 0}
        ends = [judge.World(paying, cores, set(), {}, counted).run(paying.length).releases[1][1].end / MS for counted in (None, {0: [(2 * MS, 12 * MS, 0)]})]
        self.assertEqual(ends, [22, 17])

    def test_a_handler_without_budget_goes_on_for_its_waiter_and_pays_later(self):
        edge = sets.Edge(5, MS, 10 * MS, 0, [[("l", 0), ("c", 3), ("u", 0)]])
        high = loop(1, 2, 10, [("p", 5), ("c", 1), ("l", 0), ("c", 1), ("u", 0)], [("c", 2)], [("c", 2)], [("c", 2)], [("c", 2)])
        seen = world(made(locks={0: {1: MS, -5: 3 * MS}}, loops=[high, loop(2, 4, 40, [("s", 2 * MS), ("c", 4)], sleep=2)], edges=[edge]), {2})
        # It begins at 2, behind loop 1, whose next release finds it at work.
        self.assertEqual([(begin / MS, end / MS) for begin, end in seen.runs[5][:1]], [(2, 23)])

    def test_a_handler_that_waits_for_a_lock_pays_for_the_turn_behind_that(self):
        # U is 1/2, of 40 ms. Loop 2 begins at 3, and its handler waits from 4 to 9. It uses 2 ms
        # for its activation, 2 for the turn of 9 ms, and 3: back at 3 + 14. The second edge comes
        # at 15.
        edge = sets.Edge(5, 10 * MS, 20 * MS, 0, [[("l", 0), ("c", 3), ("u", 0)]])
        low = loop(2, 20, 100, [("l", 0), ("p", 5), ("c", 4), ("u", 0), ("c", 1), ("p", 5), ("c", 8)])
        seen = world(made(switch=MS, locks={0: {2: 4 * MS, -5: 3 * MS}}, loops=[loop(1, 1, 40), low], edges=[edge]))
        self.assertEqual([(begin / MS, end / MS) for begin, end in seen.runs[5][:2]], [(4, 13), (18, 21)])

    def test_a_service_that_never_began_costs_nothing(self):
        # U is 2/7, and an activation costs 1. 3 end the budget, and the work; 2 more are beyond it.
        server = judge.Pibs(2, 7, 14, 1)
        server.wake(100)
        server.use(103, 3)
        server.block(103)
        self.assertEqual(server.back(), 114)
        server.wake(103)
        server.use(105, 2)
        server.block(105)
        self.assertEqual(server.back(), 121)

    def test_code_between_two_steps_goes_on_before_a_release_of_that_instant(self):
        # At 5 ms loop 1 wants the lock that loop 3 holds on the other core: so loop 4, due there
        # at 5 ms, waits for it.
        run = world(made(cores=2, locks={0: {1: MS, 3: 2 * MS}}, loops=[
            loop(1, 1, 5, [("l", 0), ("u", 0)]), loop(3, 5, 8, [("c", 3), ("l", 0), ("c", 2), ("u", 0)], core=1), loop(4, 1, 5, core=1)]))
        self.assertEqual(milliseconds(run.releases[4], 2), [(0, 1), (6, 7)])


class Findings(unittest.TestCase):
    def setUp(self):
        self.set = made(loops=[loop(1, 5, 10), loop(2, 4, 20)])
        self.world = world(self.set)
        runs = {number: [(one.begin, one.end) for one in releases] for number, releases in self.world.releases.items()}
        table = ["   1   10   10        0       0", "   2    5    5        0       0"]
        self.run_seen = front_door.Run(runs, {}, {}, "", table)
        self.verdict = front_door.Verdict(True, {"loops": [{"id": 1, "response_ns": 5 * MS}, {"id": 2, "response_ns": 9 * MS}]}, {})

    def test_nothing_is_wrong_with_a_run_as_it_should_be(self):
        self.assertIsNone(front_door.first_difference(self.set, self.run_seen, self.world))
        self.assertIsNone(front_door.first_late(self.set, self.run_seen, self.world))
        self.assertIsNone(front_door.first_beyond(self.set, self.verdict, self.run_seen, self.world))

    def test_a_nanosecond_is_a_difference_and_so_is_a_release_that_is_not_there(self):
        begin, end = self.run_seen.releases[2][1]
        self.run_seen.releases[2][1] = (begin, end + 1)
        self.assertIn("loop 2, run 2", front_door.first_difference(self.set, self.run_seen, self.world))
        del self.run_seen.releases[2][1:]
        self.assertIn("None in the simulator", front_door.first_difference(self.set, self.run_seen, self.world))

    def test_lateness_is_seen_where_either_counts_it(self):
        self.run_seen.table[1] = "   2    5    5        3       3"
        self.assertIn("loop 2 late 3 times", front_door.first_late(self.set, self.run_seen, self.world))
        self.run_seen.table[1] = "   2    5    5        0       0"
        self.world.late[1] = 1
        self.assertIn("1 by the judge", front_door.first_late(self.set, self.run_seen, self.world))

    def test_a_response_beyond_r_is_seen_where_only_the_simulator_has_it(self):
        begin, end = self.run_seen.releases[1][3]
        self.run_seen.releases[1][3] = (begin, end + 1)
        self.assertIn("loop 1: the release of 30000000 ns took 5000001 ns", front_door.first_beyond(self.set, self.verdict, self.run_seen, self.world))
        del self.run_seen.releases[1][0]
        self.assertIsNone(front_door.first_beyond(self.set, self.verdict, self.run_seen, self.world), "another release's: they differ")

    def test_a_response_beyond_r_is_seen_unless_something_was_changed(self):
        self.verdict.report["loops"][1]["response_ns"] -= 1
        self.assertIn("loop 2", front_door.first_beyond(self.set, self.verdict, self.run_seen, self.world))
        self.run_seen.answers = {1: [False, True]}
        self.assertIsNone(front_door.first_beyond(self.set, self.verdict, self.run_seen, self.world))


class Honesty(unittest.TestCase):
    def test_what_a_set_may_not_do(self):
        honest = made(loops=[loop(1, 5, 10, [("l", 0), ("c", 2), ("u", 0), ("c", 3)])], locks={0: {1: 2 * MS}})
        self.assertTrue(sets.is_honest(honest))
        for script in ([("c", 6)], [("c", 4), ("s", 1)], [("l", 0), ("c", 3), ("u", 0)], [("l", 0), ("c", 1)], [("l", 1), ("u", 1), ("c", 1)],
                       [("p", 3), ("a", "nic", 1), ("c", 1)], [("b", "nic", 1, 2), ("c", 1)], [("c", 3), ("l", 0), ("u", 0), ("l", 0), ("u", 0)]):
            bad = honest.copy()
            bad.loops[0].scripts = [script]
            self.assertFalse(sets.is_honest(bad), script)

    def test_the_generator_makes_honest_sets_with_everything(self):
        found = [generator.random_set(random.Random(seed)) for seed in range(150)]
        self.assertTrue(all(sets.is_honest(each) for each in found))
        for has in (lambda each: each.locks, lambda each: each.edges, lambda each: each.services, lambda each: each.switch, sets.changes,
                    lambda each: each.tick_period, lambda each: each.cores == 3, lambda each: len(each.interrupts) > 8, lambda each: each.away,
                    lambda each: any(one.sleep for one in each.loops), lambda each: any(one.sleeps > 1 for one in each.loops),
                    lambda each: each.wake_latency, lambda each: each.edge_top, lambda each: each.victim_pays, lambda each: any(not held for held in each.locks.values())):
            self.assertTrue(any(map(has, found)))
        self.assertEqual(generator.random_set(random.Random(7)), generator.random_set(random.Random(7)))
        scaled = [generator.scaled(each, 0.7) for each in found]
        self.assertTrue(all(sets.is_honest(each) for each in scaled if each))

    def test_a_set_comes_back_from_a_file(self):
        for seed in range(40):
            the_set = generator.random_set(random.Random(seed))
            self.assertEqual(minimise.from_json(minimise.to_json(the_set)), the_set)


class Shrinking(unittest.TestCase):
    def test_what_the_finding_does_not_need_goes(self):
        def look(trial):
            long = any(one.budget >= 3 * MS for one in trial.loops)
            return front_door.Finding("late", "") if long and trial.interrupts else None

        the_set = made(cores=2, switch=7, tick_period=MS, loops=[loop(1, 5, 10, [("l", 0), ("c", 5), ("u", 0)]), loop(2, 2, 13, core=1)],
                       locks={0: {1: 5 * MS}}, interrupts=[sets.Interrupt("nic", 10 * MS + 1, 0, 1234567, 99, 5), sets.Interrupt("disk", MS, 1, 5, 0, 0)])
        least, _ = minimise.least(the_set, look(the_set), look, 30)
        self.assertEqual((len(least.loops), least.cores, least.locks, least.switch, least.tick_period), (1, 1, {}, 0, 0))
        self.assertEqual(len(least.interrupts), 1)
        self.assertTrue(sets.is_honest(least))

    def test_a_sketch_is_written_as_a_person_writes_it(self):
        the_set = made(loops=[loop(1, 5, 10, [("l", 3), ("c", 2), ("u", 3)], [("c", 5)], sleep=1)], locks={3: {1: 2 * MS}})
        words = writer.sketch(the_set)
        for line in ("Mutex lock0;", "lock0.heldBy(1, 2ms);", "void loop(1, 5ms, 10ms, 0, 1ms) {", "case 0: lock0.lock(); compute(2); lock0.unlock(); break;"):
            self.assertIn(line, words)


if __name__ == "__main__":
    unittest.main()
