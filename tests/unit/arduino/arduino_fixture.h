// What the tests of the Arduino face share: a fresh fake board, and the errors that were reported.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "arduino/core/diagnostics.h"
#include "tests/unit/arduino/fake_port.h"

class ArduinoTest : public testing::Test {
  protected:
    void SetUp() override {
        qduino::fake::reset();
        errors().clear();
        before_ = qduino::arduino::set_error_handler([](const char* call, int subject, const qduino::Error&) {
            errors().push_back(std::string(call) + "(" + std::to_string(subject) + ")");
        });
    }
    void TearDown() override { qduino::arduino::set_error_handler(before_); }

    static qduino::fake::State& board() { return qduino::fake::state(); }
    static std::vector<std::string>& errors() {
        static std::vector<std::string> reported;
        return reported;
    }

  private:
    qduino::arduino::ErrorHandler before_ = nullptr;
};
