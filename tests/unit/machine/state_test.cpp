// The table of states, cell by cell: what each event does in each state, written down a second
// time.
#include "printer/machine/state.h"

#include <gtest/gtest.h>

#include <map>
#include <set>
#include <sstream>
#include <string>

namespace qduino::printer::machine::state_test {
namespace {

const std::map<State, std::string> kStateNames{
    {State::starting, "starting"}, {State::idle, "idle"},     {State::printing, "printing"},
    {State::pausing, "pausing"},   {State::paused, "paused"}, {State::cancelling, "cancelling"},
    {State::faulted, "faulted"}};
const std::map<Event, std::string> kEventNames{
    {Event::started, "Started"}, {Event::begin, "Begin"},   {Event::pause, "Pause"},
    {Event::rest, "Rest"},       {Event::resume, "Resume"}, {Event::stop, "Stop"},
    {Event::end, "End"},         {Event::fault, "Fault"},   {Event::clear, "Clear"}};

// A state: it goes there. "same": it is so already. "refused": with words. "never": the program is
// wrong.
constexpr std::string_view kExpected = R"(
            Started Begin    Pause   Rest   Resume   Stop       End   Fault   Clear
starting    idle    never    never   never  never    never      never faulted never
idle        never   printing refused never  refused  cancelling never faulted refused
printing    never   never    pausing never  same     cancelling idle  faulted refused
pausing     never   never    same    paused printing cancelling never faulted refused
paused      never   never    same    never  printing cancelling never faulted refused
cancelling  never   never    refused never  refused  same       idle  faulted refused
faulted     never   never    refused never  refused  refused    never faulted idle
)";

struct Cell {
    std::string state, event, effect;
};
std::vector<Cell> expected_cells() {
    std::istringstream text{std::string{kExpected}};
    std::string line;
    std::getline(text, line);
    std::getline(text, line);
    std::istringstream head{line};
    std::vector<std::string> events;
    for (std::string event; head >> event;) events.push_back(event);
    std::vector<Cell> cells;
    while (std::getline(text, line)) {
        std::istringstream row{line};
        std::string state, effect;
        row >> state;
        for (const std::string& event : events) {
            row >> effect;
            cells.push_back({state, event, effect});
        }
    }
    return cells;
}

template <typename Key>
Key key_of(const std::map<Key, std::string>& names, const std::string& name) {
    for (const auto& [key, known] : names)
        if (known == name) return key;
    throw std::out_of_range(name);
}

std::string effect_of(const Next& next) {
    switch (next.kind) {
        case Next::Kind::goes:
            return kStateNames.at(next.state);
        case Next::Kind::stays:
            return "same";
        case Next::Kind::refused:
            return "refused";
        case Next::Kind::impossible:
            break;
    }
    return "never";
}

class StateTable : public testing::TestWithParam<Cell> {};

TEST_P(StateTable, DoesWhatIsWrittenHere) {
    const Next next =
        machine::next(key_of(kStateNames, GetParam().state), key_of(kEventNames, GetParam().event));
    EXPECT_EQ(effect_of(next), GetParam().effect);
    EXPECT_EQ(next.why.empty(), GetParam().effect != "refused")
        << "a refusal has words, and nothing else has";
}
INSTANTIATE_TEST_SUITE_P(Cell, StateTable, testing::ValuesIn(expected_cells()),
                         [](const auto& each) { return each.param.state + each.param.event; });

TEST(States, EveryCellIsExpectedOnce) {
    EXPECT_EQ(expected_cells().size(), kAllStates.size() * kAllEvents.size());
}

TEST(States, EachIsReachedAndLeftAgain) {
    std::set<State> reached{State::starting};
    for (bool grown = true; grown;) {
        grown = false;
        for (const State state : std::set<State>{reached})
            for (const Event event : kAllEvents) {
                const Next next = machine::next(state, event);
                if (next.kind == Next::Kind::goes) grown |= reached.insert(next.state).second;
            }
    }
    EXPECT_EQ(reached.size(), kAllStates.size());
    for (const State state : kAllStates) {
        EXPECT_TRUE(std::any_of(kAllEvents.begin(), kAllEvents.end(), [&](Event event) {
            const Next next = machine::next(state, event);
            return next.kind == Next::Kind::goes && next.state != state;
        })) << kStateNames.at(state);
    }
}

TEST(States, AFaultIsLegalEverywhereAndOnlyAPersonEndsIt) {
    for (const State state : kAllStates)
        EXPECT_EQ(machine::next(state, Event::fault), (Next{Next::Kind::goes, State::faulted}));
    for (const Event event : kAllEvents) {
        const Next next = machine::next(State::faulted, event);
        const bool leaves = next.kind == Next::Kind::goes && next.state != State::faulted;
        EXPECT_EQ(leaves, event == Event::clear) << name_of(event);
    }
}

// The table is read at compile time, too.
static_assert(next(State::idle, Event::begin).state == State::printing);

}  // namespace
}  // namespace qduino::printer::machine::state_test
