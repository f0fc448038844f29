// Shared by the tests of the Arduino face: a fresh fake board with a runtime on it, and the errors
// that were reported.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "arduino/core/diagnostics.h"
#include "runtime/runtime.h"
#include "tests/fake/fake_board.h"

class ArduinoTest : public testing::Test {
  protected:
    void SetUp() override {
        errors().clear();
        before_ = qduino::arduino::set_error_handler([](const char* call, int subject, const qduino::Error&) {
            errors().push_back(std::string(call) + "(" + std::to_string(subject) + ")");
        });
    }
    void TearDown() override { qduino::arduino::set_error_handler(before_); }

    static qduino::fake::State& board() { return qduino::fake::state(); }
    /// As if loop `id` were declared, and the test its body from now on.
    void play_loop(qduino::board::VcpuId id) {
        runtime_.set_overrun_policy(id, qduino::runtime::OverrunPolicy::skip, nullptr);
        board().vcpu = id;
    }
    static std::vector<std::string>& errors() {
        static std::vector<std::string> reported;
        return reported;
    }

    struct FreshBoard {
        FreshBoard() { qduino::fake::reset(); }
    } fresh_;  // before the runtime, which reads its clock
    qduino::runtime::Runtime runtime_{qduino::fake::board()};

  private:
    qduino::arduino::ErrorHandler before_ = nullptr;
};
