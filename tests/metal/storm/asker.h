// A source of interrupts: asks who its network's host is, and again as soon as it was answered.
//
//   begin() ─► card ─► network ─► answer ─► interrupt ─► top half: quiet() ─► bottom half: serve()
//                ▲                                                                       │
//                └───────────────────────── the next question ◄──────────────────────────┘
//
// The card is the board's (board/metal/driver/e1000.h). The question is an ARP request (RFC 826)
// for 192.168.10.1, whom Bochs plays.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>

#include "board/metal/driver/e1000.h"

class Asker final : public qduino::board::metal::Device {
  public:
    /// In setup(). False: there is no card.
    bool open() {
        if (!card_.open()) return false;
        card_.add_to(qduino::board::metal::device_interrupts, *this);
        return true;
    }
    /// The first question, until it was answered. From a loop.
    void begin() {
        if (!answered_) qduino::board::metal::device_interrupts.ask(*this);
    }
    void quiet() override { card_.interrupt(false); }

  private:
    void serve() override {
        digitalWrite(5, HIGH);
        for (int i = 0; i < 150; ++i) asm volatile("");
        bool asks = !answered_;
        for (; !card_.frame().empty(); card_.release()) asks = answered_ = true;
        if (asks) ask();
        digitalWrite(5, LOW);  // first: the next interrupt's way into the kernel is not this VCPU's
        card_.interrupt(true);
    }

    void ask() {
        constexpr std::array<uint8_t, 10> kRequest{8, 6, 0, 1, 8, 0, 6, 4, 0, 1};
        constexpr std::array<uint8_t, 14> kWho{192, 168, 10, 15, 0, 0, 0, 0, 0, 0, 192, 168, 10, 1};
        const auto frame = card_.room();
        if (frame.empty()) {  // the emulator has not sent the last ones yet
            answered_ = false;
            return;
        }
        const auto& own = card_.address();
        auto end = std::fill_n(frame.begin(), own.size(), 0xff);  // to everybody
        end = std::copy(own.begin(), own.end(), end);
        end = std::copy(kRequest.begin(), kRequest.end(), end);
        end = std::copy(own.begin(), own.end(), end);
        end = std::copy(kWho.begin(), kWho.end(), end);
        card_.send(end - frame.begin());
        card_.flush();
    }

    qduino::board::metal::E1000 card_;
    std::atomic<bool> answered_{false};
};
