// Between the port that a serial host opens and the print service.
//
//   host ══ port ══► scanner ── M112 ──► the link: one atomic ──► loops 2 and 3
//             ▲        └─ every byte ──► socket ──► print service
//             └──────── answers ◄─────── socket ◄──┘
//
// The print service may use 10 ms in 100 ms, and may be killed. An M112 that it had to read would
// wait for both. So this process reads the port, and stops the printer itself. It does little else:
// each turn is one read and one write of at most kAtOnce bytes each way.
//
// The port is read at any time, whatever the service does. Bytes that it does not take are held up
// to a bound, and from there on dropped by whole lines, with a sign in their place. The service
// asks for them again (serial/held_lines.h).
//
// The socket is connected while a host is there: the service sees a host come and go so. Bytes for
// a service that is not there are scanned, and lost.
//
// One thread. Nothing is allocated once the first bytes have passed.
#pragma once

#include <filesystem>
#include <string>

#include "apps/port/port_vcpu.h"
#include "base/time.h"
#include "link/link_file.h"
#include "posix/unique_fd.h"
#include "printer/gcode/emergency_scanner.h"
#include "serial/held_lines.h"
#include "serial/serial_port.h"

namespace qduino::port {

class PortRelay {
  public:
    static constexpr std::size_t kAtOnce = 1024;
    /// Answers that wait here for a host that does not read; then the service is not read either.
    static constexpr std::size_t kAnswersMax = 65'536;

    /// `service`: where its socket is; `link`: the sketch's. Neither need be there yet.
    PortRelay(apps::SerialPort port, std::string service, std::filesystem::path link);

    /// Waits until there is something to do, 50 ms at most, and does it.
    void turn();

    [[nodiscard]] const apps::SerialPort& port() const { return port_; }

  private:
    void wait();
    void look_around();
    void find_link();
    void connect();
    void hear_out();
    void begin_anew();
    /// False: there was nothing.
    bool take_from_host();
    void stop_printer();
    void give_to_service();
    void take_from_service();
    void give_to_host();

    apps::SerialPort port_;
    std::string service_path_;
    std::filesystem::path link_path_;
    apps::LinkFile link_;
    posix::UniqueFd service_;
    PortVcpu vcpu_;
    printer::gcode::EmergencyScanner scanner_;
    apps::HeldLines to_service_;
    std::string to_host_;
    Instant look_at_{};
    bool there_ = false;  // a host
};

}  // namespace qduino::port
