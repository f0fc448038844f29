#include "base/contract.h"

#include <gtest/gtest.h>

#include <csignal>

#include <cstdio>
#include <cstdlib>

namespace qduino::contract_test {
namespace {

void safe_state_handler(const char* condition, const char*, int line) {
    std::fprintf(stderr, "outputs safe before: %s (line %s)\n", condition, line > 0 ? "known" : "unknown");
}

TEST(Contract, HoldingCostsNothing) {
    int evaluated = 0;
    QDUINO_EXPECT(++evaluated == 1);
    EXPECT_EQ(evaluated, 1);
}

TEST(ContractDeathTest, BreakingStopsWithFileAndCondition) {
    EXPECT_DEATH(QDUINO_EXPECT(1 + 1 == 3), "contract_test.cpp:[0-9]+: contract broken: 1 \\+ 1 == 3");
}

TEST(ContractDeathTest, TheHandlerRunsFirst) {
    EXPECT_DEATH(
        {
            set_contract_handler(safe_state_handler);
            QDUINO_EXPECT(false);
        },
        "outputs safe before: false \\(line known\\)\n.*contract broken: false");
}

TEST(ContractDeathTest, AHandlerThatReturnsDoesNotSaveTheProgram) {
    EXPECT_EXIT(
        {
            set_contract_handler(safe_state_handler);
            QDUINO_EXPECT(false);
            std::exit(0);
        },
        ::testing::KilledBySignal(SIGABRT), "");
}

TEST(Contract, InstallingReturnsTheOneBefore) {
    EXPECT_EQ(set_contract_handler(safe_state_handler), nullptr);
    EXPECT_EQ(set_contract_handler(nullptr), safe_state_handler);
}

}  // namespace
}  // namespace qduino::contract_test
