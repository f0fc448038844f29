// A sketch that is not written yet: it reads its loops, locks, bottom halves and what they do from
// a file, and declares them through the calls that every sketch has. So thousands of sets are
// checked and run without a compiler (front_door.py; writer.py writes the file).
//
// FRONT_DOOR_SET names the file. FRONT_DOOR_LOG names the file that takes what happened:
//   r LOOP BEGIN END      a release, in nanoseconds
//   h PIN BEGIN END       a run of a handler
//   c LOOP 0|1            a change at run time was refused or granted
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <vector>

using qduino::Nanoseconds;
using qduino::arduino::DeviceClass;

// Reading it takes what the board file says: that is how code computes.
constexpr int QUIET_PIN = 100;
constexpr int PINS = 128, LOOPS = 33, HANDLERS = 4;

struct Step {
    char kind;
    long long a, b, c;
};
using Script = std::vector<Step>;

struct Actor {
    std::vector<Script> scripts;  // run in turn, one a release
    std::size_t turn = 0;
};

struct Set {
    std::FILE* log = nullptr;
    std::vector<std::unique_ptr<Mutex>> locks;
    Actor loops[LOOPS], handlers[PINS];
    int pin_of_handler[HANDLERS] = {};
    int handler_count = 0;
    bool level[PINS] = {};
    std::vector<std::string> setup_lines;
};

// Made at the first use: loops declare themselves before main().
static Set& the_set() {
    static Set set;
    return set;
}

static DeviceClass device(long long number) { return static_cast<DeviceClass>(number); }

static void compute(long long steps) {
    for (long long i = 0; i < steps / 100; ++i) analogRead(A0);
    for (long long i = 0; i < steps % 100; ++i) digitalRead(QUIET_PIN);
}

static void note_change(int loop, bool granted) { std::fprintf(the_set().log, "c %d %d\n", loop, granted ? 1 : 0); }

static void do_step(int loop, const Step& step) {
    Set& set = the_set();
    switch (step.kind) {
        case 'c': return compute(step.a);
        case 'l': return set.locks[static_cast<std::size_t>(step.a)]->lock();
        case 'u': return set.locks[static_cast<std::size_t>(step.a)]->unlock();
        case 's': return delayUntil(timeNow() + Nanoseconds{step.a});
        case 'p': {
            bool& level = set.level[step.a];
            level = !level;
            return digitalWrite(static_cast<int>(step.a), level ? HIGH : LOW);
        }
        case 'a': return note_change(loop, (noInterrupts)(device(step.a), static_cast<int>(step.b)));
        case 'r': return note_change(loop, (interrupts)(device(step.a), static_cast<int>(step.b)));
        case 'b':
            return note_change(loop, qduino::arduino::interrupts_vcpu(device(step.a), Nanoseconds{step.b},
                                                                      Nanoseconds{step.c}, -1));
        default: std::abort();
    }
}

static void do_turn(Actor& actor, int loop) {
    if (actor.scripts.empty()) return;
    for (const Step& step : actor.scripts[actor.turn++ % actor.scripts.size()]) do_step(loop, step);
}

template <int Id>
static void body() {
    const unsigned long long began = nanos();
    do_turn(the_set().loops[Id], Id);
    std::fprintf(the_set().log, "r %d %llu %llu\n", Id, began, nanos());
    waitForNextPeriod();
}

template <int Number>
static void handler() {
    const int pin = the_set().pin_of_handler[Number];
    const unsigned long long began = nanos();
    do_turn(the_set().handlers[pin], 0);
    std::fprintf(the_set().log, "h %d %llu %llu\n", pin, began, nanos());
}

constexpr void (*BODIES[])() = {nullptr,   body<1>,  body<2>,  body<3>,  body<4>,  body<5>,  body<6>,
                                body<7>,   body<8>,  body<9>,  body<10>, body<11>, body<12>, body<13>,
                                body<14>,  body<15>, body<16>, body<17>, body<18>, body<19>, body<20>};
constexpr void (*HANDLER_BODIES[HANDLERS])() = {handler<0>, handler<1>, handler<2>, handler<3>};

static Script script_of(const char* at) {
    Script script;
    Step step{};
    int length = 0;
    while (std::sscanf(at, " %c %lld %lld %lld%n", &step.kind, &step.a, &step.b, &step.c, &length) == 4) {
        script.push_back(step);
        at += length;
    }
    return script;
}

// "loop ID BUDGET PERIOD CORE SLEEP SLEEPS" declares itself at once, as the macro does. "does loop
// ID …" and "does pin PIN …" add a script, in steps of four words. All else is for setup().
static void take_line(const char* line) {
    Set& set = the_set();
    long long id = 0, budget = 0, period = 0, core = 0, sleep = 0, sleeps = 0;
    int length = 0;
    if (std::sscanf(line, "loop %lld %lld %lld %lld %lld %lld", &id, &budget, &period, &core, &sleep, &sleeps) == 6) {
        qduino::arduino::LoopRegistration(static_cast<int>(id), Nanoseconds{budget}, Nanoseconds{period},
                                          static_cast<int>(core), Nanoseconds{sleep}, static_cast<int>(sleeps), BODIES[id], "set", 0);
    } else if (std::sscanf(line, "does loop %lld%n", &id, &length) == 1) {
        set.loops[id].scripts.push_back(script_of(line + length));
    } else if (std::sscanf(line, "does pin %lld%n", &id, &length) == 1) {
        set.handlers[id].scripts.push_back(script_of(line + length));
    } else {
        set.setup_lines.emplace_back(line);
    }
}

struct ReadSet {
    ReadSet() {
        const char* log = std::getenv("FRONT_DOOR_LOG");
        the_set().log = std::fopen(log ? log : "/dev/null", "w");
        const char* path = std::getenv("FRONT_DOOR_SET");
        std::FILE* file = path ? std::fopen(path, "r") : nullptr;
        if (!file || !the_set().log) {
            std::fprintf(stderr, "FRONT_DOOR_SET and FRONT_DOOR_LOG name a set and a log\n");
            std::exit(1);
        }
        std::vector<char> line(1 << 20);
        while (std::fgets(line.data(), static_cast<int>(line.size()), file)) take_line(line.data());
        std::fclose(file);
    }
};
static const ReadSet read_set;

static void attach(int pin, Nanoseconds budget, Nanoseconds period, int core) {
    Set& set = the_set();
    const int number = set.handler_count++;
    set.pin_of_handler[number] = pin;
    pinMode(pin, OUTPUT);
    if (budget > Nanoseconds{0})
        qduino::arduino::attach_interrupt_vcpu(pin, HANDLER_BODIES[number], CHANGE, budget, period, core);
    else
        attachInterrupt(pin, HANDLER_BODIES[number], CHANGE);
}

// By a loop, or by the handler of pin −holder.
static void say_held(Mutex& lock, long long holder, Nanoseconds length) {
    if (holder > 0) return lock.heldBy(static_cast<int>(holder), length);
    for (int number = 0; number < the_set().handler_count; ++number)
        if (the_set().pin_of_handler[number] == -holder) lock.heldBy(HANDLER_BODIES[number], length);
}

void setup() {
    Set& set = the_set();
    for (const std::string& line : set.setup_lines) {
        long long a = 0, b = 0, c = 0, d = 0;
        if (std::sscanf(line.c_str(), "lock %lld", &a) == 1) set.locks.push_back(std::make_unique<Mutex>());
        if (std::sscanf(line.c_str(), "held %lld %lld %lld", &a, &b, &c) == 3)
            say_held(*set.locks[static_cast<std::size_t>(a)], b, Nanoseconds{c});
        if (std::sscanf(line.c_str(), "serve %lld %lld %lld %lld", &a, &b, &c, &d) == 4)
            qduino::arduino::interrupts_vcpu(device(a), Nanoseconds{b}, Nanoseconds{c}, static_cast<int>(d));
        if (std::sscanf(line.c_str(), "edge %lld %lld %lld %lld", &a, &b, &c, &d) == 4)
            attach(static_cast<int>(a), Nanoseconds{b}, Nanoseconds{c}, static_cast<int>(d));
        if (std::sscanf(line.c_str(), "away %lld %lld", &a, &b) == 2) (noInterrupts)(device(a), static_cast<int>(b));
    }
}
