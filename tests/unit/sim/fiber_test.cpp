// Run twice: over the switch of this processor, and over the portable one under other suite names
// (fiber_ucontext.cpp).
#include "board/sim/fiber.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#ifndef FIBER_SUITE
#define FIBER_SUITE Fiber
#define FIBER_DEATH_SUITE FiberDeathTest
#endif

namespace qduino::board::sim::fiber_test {
namespace {

struct Counter {
    Fiber* self = nullptr;
    std::vector<int> seen;
};

TEST(FIBER_SUITE, HostAndFiberTakeTurns) {
    Counter counter;
    Fiber fiber(
        [](void* context) {
            auto& c = *static_cast<Counter*>(context);
            for (int i = 0; i < 3; ++i) {
                c.seen.push_back(i);
                c.self->suspend();
            }
        },
        &counter, 64 * 1024);
    counter.self = &fiber;
    for (int i = 0; i < 3; ++i) {
        fiber.resume();
        ASSERT_EQ(counter.seen.size(), static_cast<std::size_t>(i) + 1);
        ASSERT_FALSE(fiber.finished());
        counter.seen.back() += 10;
    }
    fiber.resume();
    EXPECT_TRUE(fiber.finished());
    EXPECT_EQ(counter.seen, (std::vector<int>{10, 11, 12}));
}

TEST(FIBER_SUITE, KeepsItsLocalsAcrossSwitches) {
    struct Context {
        Fiber* self = nullptr;
        double sum = 0;
    } context;
    Fiber fiber(
        [](void* p) {
            auto& c = *static_cast<Context*>(p);
            // In callee-saved registers or on the stack, as the compiler likes.
            double a = 1.5, b = 2.5;
            for (int i = 0; i < 1000; ++i) {
                a = std::sqrt(a + i);
                c.self->suspend();
                b += a;
            }
            c.sum = b;
        },
        &context, 64 * 1024);
    context.self = &fiber;
    double a = 1.5, b = 2.5;
    for (int i = 0; i < 1000; ++i) {
        fiber.resume();
        a = std::sqrt(a + i);
        b += a;
    }
    fiber.resume();
    ASSERT_TRUE(fiber.finished());
    EXPECT_EQ(context.sum, b);
}

int deep(Fiber* self, int depth) {
    volatile char frame[512] = {};
    frame[0] = static_cast<char>(depth);
    if (depth == 0) {
        self->suspend();
        return frame[0];
    }
    return deep(self, depth - 1) + (frame[0] == static_cast<char>(depth));
}

TEST(FIBER_SUITE, SuspendsFromDeepCallsAndManyAtOnce) {
    struct Context {
        Fiber* self = nullptr;
        int result = -1;
    };
    std::vector<Context> contexts(40);
    std::vector<std::unique_ptr<Fiber>> fibers;
    for (Context& context : contexts) {
        fibers.push_back(std::make_unique<Fiber>(
            [](void* p) {
                auto& c = *static_cast<Context*>(p);
                c.result = deep(c.self, 100);
            },
            &context, 256 * 1024));
        context.self = fibers.back().get();
    }
    for (auto& fiber : fibers) fiber->resume();
    for (auto& fiber : fibers) EXPECT_FALSE(fiber->finished());
    for (auto& fiber : fibers) fiber->resume();
    for (std::size_t i = 0; i < fibers.size(); ++i) {
        EXPECT_TRUE(fibers[i]->finished());
        EXPECT_EQ(contexts[i].result, 100);
    }
}

TEST(FIBER_SUITE, ExceptionsAreThrownAndCaughtOnItsStack) {
    std::string caught;
    Fiber fiber(
        [](void* p) {
            try {
                throw std::runtime_error("inside");
            } catch (const std::exception& error) {
                *static_cast<std::string*>(p) = error.what();
            }
        },
        &caught, 128 * 1024);
    fiber.resume();
    EXPECT_TRUE(fiber.finished());
    EXPECT_EQ(caught, "inside");
}

TEST(FIBER_SUITE, OneFiberMayRunAnother) {
    struct Context {
        Fiber* inner = nullptr;
        std::string order;
    } context;
    Fiber inner([](void* p) { static_cast<Context*>(p)->order += "inner "; }, &context, 64 * 1024);
    context.inner = &inner;
    Fiber outer(
        [](void* p) {
            auto& c = *static_cast<Context*>(p);
            c.order += "outer ";
            c.inner->resume();
            c.order += "outer";
        },
        &context, 64 * 1024);
    outer.resume();
    EXPECT_TRUE(outer.finished());
    EXPECT_EQ(context.order, "outer inner outer");
}

TEST(FIBER_SUITE, AnUnfinishedOneIsAbandoned) {
    for (int i = 0; i < 100;
         ++i) {  // the mapping is used again: nothing of the old stack may be left to stumble over
        struct Context {
            Fiber* self = nullptr;
        } context;
        Fiber fiber([](void* p) { deep(static_cast<Context*>(p)->self, 50); }, &context, 256 * 1024);
        context.self = &fiber;
        fiber.resume();
        EXPECT_FALSE(fiber.finished());
    }
}

TEST(FIBER_DEATH_SUITE, AnOverflowFaultsAtTheGuardPage) {
    EXPECT_DEATH(
        {
            struct Context {
                Fiber* self = nullptr;
            } context;
            Fiber fiber([](void* p) { deep(static_cast<Context*>(p)->self, 100'000'000); }, &context,
                        64 * 1024);
            context.self = &fiber;
            fiber.resume();
        },
        "");
}

}  // namespace
}  // namespace qduino::board::sim::fiber_test
