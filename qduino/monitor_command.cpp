#include "qduino/monitor_command.h"

#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <optional>
#include <span>
#include <vector>

#include "posix/small_file.h"
#include "qduino/monitor/monitor_text.h"
#include "qduino/monitor/monitor_tty.h"
#include "qduino/monitor/plot_server.h"
#include "qduino/upload/serial_way.h"
#include "terminal/message.h"
#include "terminal/program.h"

namespace qduino::apps {
namespace {

using posix::UniqueFd;

class Monitor {
  public:
    Monitor(const Arguments& arguments, SerialWay way, std::optional<PlotServer> plot)
        : raw_(arguments.raw),
          line_end_(line_end_of(arguments.line_end)),
          text_(arguments.timestamps ? time_before_line : std::function<std::string()>{}),
          way_(std::move(way)),
          plot_(std::move(plot)),
          signals_(block_and_watch({SIGINT, SIGTERM, SIGHUP})) {}

    /// Until one side ends.
    Result<int> run();

  private:
    bool take_serial();
    bool take_typed();

    bool raw_;
    std::string_view line_end_;
    MonitorText text_;
    SerialWay way_;
    std::optional<PlotServer> plot_;
    UniqueFd signals_;
    bool typing_ = true;
    bool quits_ = false;
};

bool Monitor::take_serial() {
    std::array<char, 16 * 1024> bytes;
    const auto count = posix::read_some(way_.socket.get(), bytes, "Serial");
    if (!count || *count == 0) return false;
    const std::string_view seen{bytes.data(), *count};
    if (plot_) plot_->take(seen);
    const std::string shown = raw_ ? std::string(seen) : text_.shown(seen);
    return plot_.has_value() || posix::write_all(STDOUT_FILENO, shown, "the terminal").ok();
}

bool Monitor::take_typed() {
    std::array<char, 4096> bytes;
    const auto count = posix::read_some(STDIN_FILENO, bytes, "the terminal");
    typing_ = count && *count > 0;
    if (!typing_) return !raw_;  // whoever asked for raw bytes has gone
    const std::string_view typed{bytes.data(), *count};
    const std::string sent = raw_ ? std::string(typed) : with_line_ends(typed, line_end_);
    return posix::write_all(way_.socket.get(), sent, "Serial").ok();
}

Result<int> Monitor::run() {
    ::signal(SIGPIPE, SIG_IGN);
    for (bool goes_on = true; goes_on;) {
        std::vector<pollfd> looks{{signals_.get(), POLLIN, 0},
                                  {way_.socket.get(), POLLIN, 0},
                                  {typing_ ? STDIN_FILENO : -1, POLLIN, 0}};
        const std::size_t own = looks.size();
        if (plot_) {
            for (const pollfd& wait : plot_->waits()) looks.push_back(wait);
        }
        if (::poll(looks.data(), looks.size(), -1) <= 0) continue;
        if (plot_) plot_->serve(std::span(looks).subspan(own));
        quits_ = looks[0].revents != 0;
        goes_on =
            !quits_ && (looks[1].revents == 0 || take_serial()) && (looks[2].revents == 0 || take_typed());
    }
    if (text_.in_line()) std::fputs("\n", stdout);
    std::fflush(stdout);
    const int status = close_way(way_);
    if (!raw_ && !quits_) say(status == 0 ? "The sketch has ended.\n" : "The monitor there has ended.\n");
    return quits_ ? 0 : status;
}

}  // namespace

Result<int> monitor_command(const Arguments& arguments) {
    if (!arguments.tty.empty()) return monitor_tty(arguments.tty, arguments.to);
    QDUINO_TRY_ASSIGN(SerialWay way, open_way(arguments.to));
    std::optional<PlotServer> plot;
    if (arguments.plot) {
        QDUINO_TRY_ASSIGN(plot, PlotServer::listen(arguments.plot_port));
        std::printf("%s\n", plot->address().c_str());
        std::fflush(stdout);
    }
    return Monitor(arguments, std::move(way), std::move(plot)).run();
}

}  // namespace qduino::apps
