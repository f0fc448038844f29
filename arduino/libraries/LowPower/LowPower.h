// LowPower: the AVR's sleep modes, under the names of the library for them. (API of "Low-Power",
// github.com/rocketscream/Low-Power.)
//
//   handler                          ▌ of attachInterrupt()
//   loop      █ powerDown(SLEEP_1S) ··█      the calling loop sleeps and consumes no budget
//
// The watchdog's time ends the sleep, and so does a handler, within 1 ms after it has run. All
// modes are this one. Other loops go on, and so does millis(). What the further words switch off
// (converter, brown-out detector, timers, ports) stays on: it is not the loop's own here.
#pragma once

#include <type_traits>

enum period_t {
    SLEEP_15MS,
    SLEEP_30MS,
    SLEEP_60MS,
    SLEEP_120MS,
    SLEEP_250MS,
    SLEEP_500MS,
    SLEEP_1S,
    SLEEP_2S,
    SLEEP_4S,
    SLEEP_8S,
    SLEEP_FOREVER  ///< until a handler has run
};
enum bod_t { BOD_OFF, BOD_ON };
enum adc_t { ADC_OFF, ADC_ON };
enum timer5_t { TIMER5_OFF, TIMER5_ON };
enum timer4_t { TIMER4_OFF, TIMER4_ON };
enum timer3_t { TIMER3_OFF, TIMER3_ON };
enum timer2_t { TIMER2_OFF, TIMER2_ON };
enum timer1_t { TIMER1_OFF, TIMER1_ON };
enum timer0_t { TIMER0_OFF, TIMER0_ON };
enum spi_t { SPI_OFF, SPI_ON };
enum usart0_t { USART0_OFF, USART0_ON };
enum usart1_t { USART1_OFF, USART1_ON };
enum usart2_t { USART2_OFF, USART2_ON };
enum usart3_t { USART3_OFF, USART3_ON };
enum twi_t { TWI_OFF, TWI_ON };
enum usb_t { USB_OFF, USB_ON };

/// May be called from any loop, and in setup(). Returns early when the sketch is to stop.
class LowPowerClass {
  public:
    /// The words differ from one AVR to the next: those of each are taken.
    template <typename... Parts>
    requires(std::is_enum_v<Parts>&&...) void idle(period_t period, adc_t, Parts...) { sleep(period); }
    void adcNoiseReduction(period_t period, adc_t, timer2_t) { sleep(period); }
    void powerDown(period_t period, adc_t, bod_t) { sleep(period); }
    void powerSave(period_t period, adc_t, bod_t, timer2_t) { sleep(period); }
    void powerStandby(period_t period, adc_t, bod_t) { sleep(period); }
    void powerExtStandby(period_t period, adc_t, bod_t, timer2_t) { sleep(period); }

  private:
    static void sleep(period_t period);
};

extern LowPowerClass LowPower;
