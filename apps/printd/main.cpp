// printd: the print service. A process of its own, without rights, that may be killed at any
// instant.
//
//   LinkWatch ─┐                       ┌─ Server ── sockets
//   Inspection ┼─► Spool ◄─ Service ◄──┤
//   Analyzer ──┘      ▲                └─ Publisher ── live stream, log
//                     └── ticks, on the spool's thread
#include <sodium/core.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>

#include "analysis/preflight_analyzer.h"
#include "apps/printd/inspection.h"
#include "apps/printd/kept_settings_file.h"
#include "apps/printd/options.h"
#include "apps/printd/own_addresses.h"
#include "apps/printd/own_certificate.h"
#include "apps/printd/serial_host.h"
#include "apps/printd/step_cost_file.h"
#include "base/version.h"
#include "config/machine_file.h"
#include "link/link_file.h"
#include "posix/guarded_file.h"
#include "posix/small_file.h"
#include "rights/own_view.h"
#include "rights/privileges.h"
#include "spool/disk/disk_storage.h"
#include "spool/disk/recovery.h"
#include "spool/link_source.h"
#include "web/api/config_json.h"
#include "web/net/key_file.h"
#include "web/net/prometheus_metrics.h"
#include "web/net/qr_code.h"
#include "web/net/server.h"
#include "web/net/static_folder.h"
#include "web/publisher.h"

namespace {

using namespace qduino;

/// The spool's way to the sketch's link: finds it by its path, and finds it again when the sketch
/// was started anew.
class LinkWatch final : public spool::LinkSource {
  public:
    explicit LinkWatch(std::filesystem::path path) : path_(std::move(path)) {}

    printer::link::LinkLayout* current() override { return file_.get(); }
    /// A path that names nothing replaces nothing: the mapped link stays until there is a newer
    /// one.
    bool is_replaced() override {
        if (!file_) return std::filesystem::exists(path_, ignored_);
        return std::filesystem::exists(path_, ignored_) && !file_.is_current(path_);
    }
    void reopen() override {
        file_ = {};
        auto opened = apps::open_link(path_);
        if (opened.ok()) {
            file_ = std::move(*opened);
            file_.get()->service_pid.store(static_cast<std::uint32_t>(::getpid()), std::memory_order_release);
            trouble_.clear();
        } else if (opened.error().code != ErrorCode::not_found) {
            trouble_ = opened.error().message.view();
        }
    }
    /// Why the link cannot be used although it is there; empty when it can.
    [[nodiscard]] const std::string& trouble() const { return trouble_; }

  private:
    std::filesystem::path path_;
    apps::LinkFile file_;
    std::string trouble_;
    std::error_code ignored_;
};

constexpr int kCouldNotStart = 1;
constexpr int kAlreadyRunning = 3;

web::Moment clock_now() {
    using namespace std::chrono;
    return {instant_from_ns(duration_cast<nanoseconds>(steady_clock::now().time_since_epoch()).count()),
            duration_cast<seconds>(system_clock::now().time_since_epoch()).count()};
}

int fail(const Error& error) {
    spdlog::error("{}", error.message.view());
    return error.code == ErrorCode::already_exists ? kAlreadyRunning : kCouldNotStart;
}

void start_log(bool verbose) {
    spdlog::set_default_logger(spdlog::stderr_color_mt("printd"));
    spdlog::set_pattern("%Y-%m-%d %H:%M:%S.%e %n %l: %v");
    spdlog::set_level(verbose ? spdlog::level::debug : spdlog::level::info);
}

/// Rights, lock and key: everything that must be settled before a thread starts.
struct Ground {
    posix::UniqueFd lock;
    std::string key;
    posix::UniqueFd socket;                 ///< of the network, where that was left; else none
    std::optional<web::TlsIdentity> given;  ///< a certificate that the owner has given
};

/// Read before the rights are given up: a private key is often for root alone.
Result<std::optional<web::TlsIdentity>> given_identity(const printd::Options& options) {
    std::optional<web::TlsIdentity> given;
    if (options.tls_certificate.empty()) return given;
    given.emplace();
    QDUINO_TRY_ASSIGN(given->certificate_pem, posix::read_small_file(options.tls_certificate));
    QDUINO_TRY_ASSIGN(given->key_pem, posix::read_small_file(options.tls_key));
    return given;
}

/// Every name and address that a browser may have come to.
web::CertificateNames certificate_names(const printd::Options& options) {
    web::CertificateNames names{options.hosts, printd::own_addresses()};
    if (!options.name.empty())
        names.names.insert(names.names.begin(), {options.name + ".local", options.name});
    names.names.emplace_back("localhost");
    return names;
}

/// The certificate of this service, and how it is kept good.
class Certificate {
  public:
    Certificate(const printd::Options& options, std::optional<web::TlsIdentity> given)
        : options_(options), given_(std::move(given)) {}

    /// Null: none is needed, since nobody else can connect.
    Result<std::shared_ptr<const web::TlsContext>> context() {
        web::TlsIdentity identity;
        if (given_) {
            identity = *given_;
        } else if (!web::is_loopback_address(options_.address)) {
            QDUINO_TRY_ASSIGN(identity, own());
        } else {
            return std::shared_ptr<const web::TlsContext>{};
        }
        fingerprint_ = web::fingerprint_of(identity.certificate_pem);
        auto made = web::TlsContext::make(identity);
        if (!made)
            return make_error(made.error().code, "the certificate cannot be used: ", made.error().message);
        return std::shared_ptr<const web::TlsContext>{std::move(*made)};
    }
    /// A new one when it is time for that, once a minute at most; null: the old one stays.
    std::shared_ptr<const web::TlsContext> renewed(Instant now) {
        if (given_ || fingerprint_.empty() || now - looked_at_ < std::chrono::minutes{1}) return nullptr;
        looked_at_ = now;
        const std::string before = fingerprint_;
        const auto made = context();
        return made && fingerprint_ != before ? *made : nullptr;
    }
    [[nodiscard]] const std::string& fingerprint() const { return fingerprint_; }

  private:
    Result<web::TlsIdentity> own() const {
        QDUINO_TRY_ASSIGN(
            printd::OwnCertificate made,
            printd::own_certificate(options_.state, certificate_names(options_), clock_now().now_s));
        if (made.made_anew)
            spdlog::info("a certificate was made, SHA-256 {}",
                         web::fingerprint_of(made.identity.certificate_pem));
        return std::move(made.identity);
    }

    const printd::Options& options_;
    std::optional<web::TlsIdentity> given_;
    std::string fingerprint_;
    Instant looked_at_{};
};

/// As root: hides from the service what it does not need. Where the system has no namespaces the
/// service goes on without, and says so.
///
/// Whatever the service reads after this must be in one of these folders. A service for this
/// computer alone leaves the network: its socket stays. One for others needs their addresses.
void hide_the_rest(const printd::Options& options, Ground& ground) {
    std::vector<rights::SeenFolder> seen{{options.state, true}};
    for (const std::filesystem::path& file :
         std::initializer_list<std::filesystem::path>{options.link, options.inspect, options.vcpu})
        if (!file.empty()) seen.push_back({file.parent_path()});
    if (!options.serial_port.empty())  // a socket that it makes
        seen.push_back({std::filesystem::path{options.serial_port}.parent_path(), true});
    if (!options.ui.empty()) seen.push_back({options.ui});
    seen.push_back({"/etc/localtime"});
    seen.push_back({"/usr/share/zoneinfo"});
    ::tzset();
    if (web::is_loopback_address(options.address)) {
        const bool ipv6 = options.address.find(':') != std::string::npos;
        posix::UniqueFd socket{::socket(ipv6 ? AF_INET6 : AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)};
        const Result<void> left = rights::leave_network();
        if (left) ground.socket = std::move(socket);
        if (!left) spdlog::warn("{}: the service sees the network", left.error().message.view());
    }
    if (const Result<void> hidden = rights::see_only(seen); !hidden)
        spdlog::warn("{}: the service sees all files that its user may read", hidden.error().message.view());
}

Result<Ground> prepare(const printd::Options& options) {
    ::umask(077);
    std::signal(SIGPIPE, SIG_IGN);
    if (sodium_init() < 0) return make_error(ErrorCode::internal, "no source of random numbers");
    if (!options.authentication && !web::is_loopback_address(options.address)) {
        return make_error(ErrorCode::not_permitted,
                          "--no-auth is only for a loopback address: anyone could print");
    }
    Ground ground;
    QDUINO_TRY_ASSIGN(ground.lock, rights::lock_state(options.state));
    QDUINO_TRY_ASSIGN(ground.given, given_identity(options));
    // The service's own user could not open afterwards what root writes during a recovery.
    const bool recovers_as_root = options.recover && options.run_as.empty() && ::geteuid() == 0;
    const std::string user = recovers_as_root ? rights::owner_of(options.state) : options.run_as;
    const auto hide = [&] {
        if (!options.recover) hide_the_rest(options, ground);
    };
    if (!user.empty()) QDUINO_TRY(rights::become(user, options.state, hide));
    QDUINO_TRY_ASSIGN(std::string key, web::load_or_make_key(options.state / "api-key"));
    if (options.authentication) ground.key = std::move(key);
    return ground;
}

web::api::Context context_of(spool::Spool& spool, const printer::MachineConfig& machine,
                             const std::filesystem::path& vcpu) {
    web::api::Context context{
        spool, machine, web::api::config_json(machine, version()), std::string{version()},
        [machine](std::string_view line) { return analysis::check_line(machine, line); }};
    context.own_vcpu_json = [vcpu] {
        const auto read = posix::read_small_file(vcpu);
        return read ? *read : std::string{};
    };
    return context;
}

/// The address under which others reach the service, without a slash at its end; this computer's
/// own when nobody else can.
std::string address_of(const printd::Options& options, std::uint16_t port, bool tls) {
    std::string host = options.address;
    if (host == "::" || host == "0.0.0.0") host = printd::address_for_others();
    if (host.empty()) host = "127.0.0.1";
    if (host.find(':') != std::string::npos) host = "[" + host + "]";
    return text<std::string>(tls ? "https://" : "http://", host, ':', port);
}

/// The link for a browser is one line; behind it, where there is a certificate, its fingerprint.
void say_where(const printd::Options& options, const std::string& address, const std::string& key,
               const std::string& fingerprint) {
    spdlog::info("listening on {}/", address);
    if (!options.authentication) spdlog::warn("authentication is off: whoever can connect can print");
    if (!options.print_link) return;
    std::printf("%s/%s%s%s%s\n", address.c_str(), key.empty() ? "" : "#key=", key.c_str(),
                fingerprint.empty() ? "" : " ", fingerprint.c_str());
    std::fflush(stdout);
}

std::vector<std::string> allowed_hosts(const printd::Options& options) {
    std::vector<std::string> hosts = options.hosts;
    if (!options.name.empty()) hosts.insert(hosts.end(), {options.name, options.name + ".local"});
    return hosts;
}

void say_step_cost(Nanoseconds cost) {
    spdlog::info("a step takes {} ns of its core: jobs above {:.0f} steps/s are refused", cost.count(),
                 printer::step_rate_limit_hz(cost));
}

/// Null: no serial host is wanted.
Result<std::unique_ptr<printd::SerialHost>> start_serial_host(const printd::Options& options,
                                                              spool::Spool& spool, web::Executor on_spool,
                                                              bool has_bed) {
    if (options.serial_port.empty()) return std::unique_ptr<printd::SerialHost>{};
    QDUINO_TRY_ASSIGN(auto port, apps::SerialPort::relayed(options.serial_port, !options.serial_wire));
    return printd::SerialHost::start(std::move(port), spool, std::move(on_spool), has_bed);
}

spool::SpoolOptions spool_options_of(const printd::Options& options) {
    spool::SpoolOptions spool;
    spool.hold_after_failure = options.after_failure == "hold";
    spool.confirm_bed = options.confirm_bed;
    spool.retention = {options.keep_jobs, options.keep_days, options.store_max_mib << 20};
    return spool;
}

Result<std::unique_ptr<spool::DiskStorage>> open_storage(const printd::Options& options,
                                                         spool::Analyzer& analyzer) {
    spool::DiskOptions disk{.folder = options.state, .analyzer = &analyzer, .opened_s = clock_now().now_s};
    disk.limits.size_max_bytes = options.upload_max_mib << 20;
    return spool::DiskStorage::open(std::move(disk));
}

Result<void> serve(const printd::Options& options, const printer::MachineConfig& machine, Ground ground) {
    LinkWatch link{options.link};
    std::optional<printd::Inspection> inspection;
    if (!options.inspect.empty()) inspection.emplace(options.inspect);
    analysis::PreflightAnalyzer analyzer{machine};
    printd::StepCostFile step_cost{options.state, analyzer};
    printd::KeptSettingsFile kept{options.state};
    QDUINO_TRY_ASSIGN(auto storage, open_storage(options, analyzer));
    QDUINO_TRY_ASSIGN(const auto spool, spool::Spool::open(spool_options_of(options), std::move(storage),
                                                           link, inspection ? &*inspection : nullptr));
    for (const std::string& line : spool->take_log()) spdlog::info("{}", line);
    QDUINO_TRY_ASSIGN(auto sessions, spool->store().sessions());
    web::StaticFiles files;
    if (!options.ui.empty()) {
        QDUINO_TRY_ASSIGN(files, web::read_static_folder(options.ui));
    }
    std::string network_address;  // set before anything is served
    web::api::Context context = context_of(*spool, machine, options.vcpu);
    context.network_address = [&network_address] { return network_address; };
    web::PrometheusMetrics metrics;
    context.metrics = &metrics;
    context.qr_code = web::qr_code_of;
    // Last in, first out: the threads end before what their tasks use.
    std::unique_ptr<web::Service> service;
    std::unique_ptr<web::Publisher> publisher;
    std::unique_ptr<printd::SerialHost> serial_host;
    web::Threads threads;
    service = std::make_unique<web::Service>(
        web::ServiceOptions{web::HostPolicy{allowed_hosts(options)}, 32,
                            web::Proxies{options.trusted_proxies}, options.prologue},
        std::move(context), web::Authenticator{ground.key, std::move(sessions), web::random_token},
        std::move(files), analyzer, threads.executors());
    publisher = std::make_unique<web::Publisher>(*spool, *service, threads.executors().io,
                                                 [](const std::string& line) { spdlog::info("{}", line); });
    web::ServerOptions server_options;
    server_options.address = options.address;
    server_options.port = options.port;
    server_options.socket = ground.socket.release();
    Certificate certificate{options, std::move(ground.given)};
    QDUINO_TRY_ASSIGN(server_options.tls, certificate.context());
    const bool tls = server_options.tls != nullptr;
    QDUINO_TRY_ASSIGN(const auto server, web::Server::listen(server_options, threads, *service, clock_now));
    QDUINO_TRY_ASSIGN(serial_host,
                      start_serial_host(options, *spool, threads.executors().spool, machine.has_bed));
    if (!web::is_loopback_address(options.address))
        network_address = address_of(options, server->port(), tls);
    say_where(options, address_of(options, server->port(), tls), ground.key, certificate.fingerprint());
    threads.every(web::Publisher::kTickEvery, [&, said = std::string{}]() mutable {
        const web::Moment now = clock_now();
        publisher->tick(now);
        if (auto renewed = certificate.renewed(now.now)) server->use(std::move(renewed));
        if (serial_host) serial_host->tick(now.now);
        if (link.trouble() != said && !link.trouble().empty()) spdlog::warn("{}", link.trouble());
        said = link.trouble();
        if (kept.take(link.current())) spdlog::info("the settings are kept (M500)");
        if (step_cost.take(link.current())) say_step_cost(analyzer.step_cost());
    });
    threads.stop_on_signals([](int signal) { spdlog::info("stopping on signal {}", signal); });
    threads.run();
    if (serial_host) serial_host->stop();
    threads.join();
    return {};
}

/// Offline: makes jobs out of their files (spool/disk/recovery.h).
Result<void> recover(const printd::Options& options, const printer::MachineConfig& machine) {
    analysis::PreflightAnalyzer analyzer{machine};
    const printd::StepCostFile step_cost{options.state, analyzer};
    const auto say = [](const std::string& line) { std::printf("%s\n", line.c_str()), std::fflush(stdout); };
    QDUINO_TRY_ASSIGN(const spool::Recovered done,
                      spool::recover_folder(options.state, analyzer, clock_now().now_s, say));
    std::printf("%zu jobs made, all held; %zu stored files had theirs; %zu left in %s/set-aside\n", done.jobs,
                done.known, done.left, options.state.c_str());
    return {};
}

Result<void> apply_kept_settings(const std::filesystem::path& file, printer::MachineConfig& machine) {
    const Result<std::string> text = posix::read_guarded(file, printd::kKeptSettingsBytesMax);
    if (text) return apps::apply_kept(*text, file.native(), machine);
    if (text.error().code == ErrorCode::not_found) return {};
    spdlog::warn("what M500 has kept does not count: {}", text.error().message.view());
    return {};
}

Result<void> run(const printd::Options& options) {
    // Where root starts this, the machine file is read by root's rights: it may lie in root's home.
    // What the service itself has written is read by the service's.
    QDUINO_TRY_ASSIGN(printer::MachineConfig machine, apps::read_machine_file(options.machine));
    QDUINO_TRY_ASSIGN(Ground ground, prepare(options));
    QDUINO_TRY(apply_kept_settings(printd::kept_settings_path(options.state), machine));
    return options.recover ? recover(options, machine) : serve(options, machine, std::move(ground));
}

}  // namespace

int main(int argc, char** argv) {
    int exit_status = 0;
    std::optional<printd::Options> options = printd::parse_options(argc, argv, exit_status);
    if (!options) return exit_status;
    // The working folder is another one once the rest of the files is hidden.
    const auto from_the_top = [](auto& path) {
        if (!path.empty()) path = std::filesystem::absolute(path);
    };
    from_the_top(options->state);
    from_the_top(options->link);
    from_the_top(options->ui);
    from_the_top(options->inspect);
    from_the_top(options->vcpu);
    from_the_top(options->serial_port);
    start_log(options->verbose);
    const Result<void> ended = run(*options);
    return ended ? 0 : fail(ended.error());
}
