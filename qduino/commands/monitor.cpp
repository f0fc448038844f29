// qduino monitor: Serial of an uploaded sketch in this terminal, or as curves in a browser.
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "posix/small_file.h"
#include "qduino/command.h"
#include "qduino/monitor/monitor_text.h"
#include "qduino/monitor/monitor_tty.h"
#include "qduino/monitor/plot_server.h"
#include "qduino/options.h"
#include "qduino/upload/serial_way.h"
#include "terminal/message.h"
#include "terminal/program.h"

namespace qduino::apps {
namespace {

using posix::UniqueFd;

class Session {
  public:
    struct Look {
        bool raw = false, timestamps = false;
        std::string line_end = "nl";
    };

    Session(const Look& look, SerialWay way, std::optional<PlotServer> plot)
        : raw_(look.raw),
          line_end_(line_end_of(look.line_end)),
          text_(look.timestamps ? time_before_line : std::function<std::string()>{}),
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

bool Session::take_serial() {
    std::array<char, 16 * 1024> bytes;
    const auto count = posix::read_some(way_.socket.get(), bytes, "Serial");
    if (!count || *count == 0) return false;
    const std::string_view seen{bytes.data(), *count};
    if (plot_) plot_->take(seen);
    const std::string shown = raw_ ? std::string(seen) : text_.shown(seen);
    return plot_.has_value() || posix::write_all(STDOUT_FILENO, shown, "the terminal").ok();
}

bool Session::take_typed() {
    std::array<char, 4096> bytes;
    const auto count = posix::read_some(STDIN_FILENO, bytes, "the terminal");
    typing_ = count && *count > 0;
    if (!typing_) return !raw_;  // whoever asked for raw bytes has gone
    const std::string_view typed{bytes.data(), *count};
    const std::string sent = raw_ ? std::string(typed) : with_line_ends(typed, line_end_);
    return posix::write_all(way_.socket.get(), sent, "Serial").ok();
}

Result<int> Session::run() {
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

class Monitor final : public Command {
    void declare(CLI::App& app) override {
        to_.declare(app);
        CLI::Option* raw = app.add_flag("--raw", look_.raw, "Bytes as they are, both ways");
        app.add_flag("--timestamps", look_.timestamps, "The time in front of each line")->excludes(raw);
        add_option(app, "--line-end", look_.line_end, "Of lines you type: nl (default), cr, crlf, none",
                   "END")
            ->check(CLI::IsMember({"nl", "cr", "crlf", "none"}))
            ->excludes(raw);
        CLI::Option* plot = app.add_flag("--plot", plot_, "Curves in a browser")->excludes(raw);
        add_option(app, "--port", plot_port_, "The page's port (default: a free one)", "N")
            ->check(whole_number_within(1, 65535))
            ->needs(plot);
        add_option(app, "--tty", tty_, "A serial port for other programs, until Ctrl-C", "LINK")
            ->excludes(raw)
            ->excludes(plot)
            ->excludes("--timestamps")
            ->excludes("--line-end");
    }

    Result<int> run() override {
        if (!tty_.empty()) return monitor_tty(tty_, to_.host);
        QDUINO_TRY_ASSIGN(SerialWay way, open_way(to_.host));
        std::optional<PlotServer> plot;
        if (plot_) {
            QDUINO_TRY_ASSIGN(plot, PlotServer::listen(plot_port_));
            std::printf("%s\n", plot->address().c_str());
            std::fflush(stdout);
        }
        return Session(look_, std::move(way), std::move(plot)).run();
    }

    ToOption to_;
    Session::Look look_;
    std::string tty_;  // a link to a terminal; empty: none
    bool plot_ = false;
    int plot_port_ = 0;
};

const Listed<Monitor> monitor_listed{
    {Place::monitor, "monitor", "Serial of an uploaded sketch",
     "Shows what the sketch prints, first its last 64 KiB, and sends it what you\n"
     "type, a line at a time. Several may look at once. --plot prints an address: a\n"
     "page of this computer that draws lines such as 'in:23.5,out:40' as curves, as\n"
     "the Arduino IDE's plotter does. Ends with the sketch, or at Ctrl-C.\n"
     "Example: qduino monitor --to pi@printer.local --timestamps"}};

}  // namespace
}  // namespace qduino::apps
