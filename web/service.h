// The service behind the connections: admission, the meaning of a request, and the way of an
// upload. No sockets.
//
//   plan(head)   I/O thread     host, origin, authentication, route
//                               → how the body is to be taken, or the answer
//   handle       as the row of the route says (web/api/route.h): its handler
//   upload       disk thread    pieces → file, seal;  analysis thread: piece for piece judged, so
//                               that a bad line is refused where it stands; facts and verdict;
//                               spool's thread: queue it
//
// Threads are handed in as functions that run a task there. In the program each is a thread; in
// tests and fuzzing the task runs at once. Answers always come back on the I/O thread.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "spool/analyzer.h"
#include "web/api/route.h"
#include "web/authentication.h"
#include "web/http/forwarded.h"
#include "web/http/http.h"
#include "web/http/origin.h"
#include "web/http/static_files.h"
#include "web/live.h"
#include "web/metrics.h"
#include "web/upload.h"

namespace qduino::web {

/// The time of one event, in both of its forms.
struct Moment {
    Instant now;
    spool::UnixSeconds now_s = 0;
};

using Task = std::function<void()>;
using Executor = std::function<void(Task)>;

struct Executors {
    Executor io;
    Executor spool;
    Executor disk;
    Executor analysis;
};

/// The way in which a request is to be taken.
struct Plan {
    enum class Kind : std::uint8_t {
        respond,  ///< with `response`; a body is not wanted
        collect,  ///< the body, up to `body_max` bytes; then handle()
        upload,   ///< the body goes to `upload`, piece by piece; then end_upload()
        live,     ///< the connection becomes a live stream
    };
    Kind kind = Kind::respond;
    Response response{};
    std::size_t body_max = 0;
    std::shared_ptr<Upload> upload{};
    Proof proof = Proof::none;
    bool proves = false;  ///< a login: who succeeds with it has shown the key
};

using Reply = std::function<void(Response)>;

struct ServiceOptions {
    HostPolicy hosts;
    std::size_t uploads_max = 32;  ///< under way at once
    Proxies proxies{};
    /// What brings neither homing nor heating is homed and heated first, also where nobody asks.
    bool prologue = false;
};

class Service {
  public:
    static constexpr std::size_t kBodyMax = 64 * 1024;
    static constexpr std::size_t kLoginBodyMax = 4096;

    /// All references outlive the service.
    Service(ServiceOptions options, api::Context context, Authenticator authenticator, StaticFiles files,
            spool::Analyzer& analyzer, Executors executors);
    Service(const Service&) = delete;
    Service& operator=(const Service&) = delete;

    /// The sender of the request.
    [[nodiscard]] Client client_of(const RequestHead& head, const Peer& peer) const {
        return options_.proxies.client_of(head, peer);
    }
    /// I/O thread, once a request's head is known.
    [[nodiscard]] Plan plan(const RequestHead& head, const Client& client, Moment moment);
    /// I/O thread, once the body is whole. Contract: its plan said collect.
    void handle(std::shared_ptr<const Request> request, Moment moment, Reply reply);

    /// I/O thread; one piece at a time. `done` comes on the I/O thread: with a refusal, the rest of
    /// the body is not wanted.
    void take_piece(std::shared_ptr<Upload> upload, std::string piece,
                    std::function<void(std::optional<Response>)> done);
    /// The body is whole: analyze, queue, answer.
    void end_upload(std::shared_ptr<Upload> upload, std::shared_ptr<const Request> request, Moment moment,
                    Reply reply);
    /// Tells the live stream; `size` 0: not known.
    void report_upload(const Upload& upload, std::uint64_t size);

    [[nodiscard]] LiveHub& live() { return live_; }
    [[nodiscard]] Metrics& metrics() { return *context_.metrics; }

  private:
    [[nodiscard]] std::optional<Response> refuse(const RequestHead& head, const Client& client, Moment moment,
                                                 Proof& proof);
    [[nodiscard]] std::optional<Response> refuse(api::Guard guard, const RequestHead& head,
                                                 const Client& client, Moment moment, Proof& proof);
    [[nodiscard]] std::optional<Response> refuse_visitor(const RequestHead& head, const Client& client,
                                                         Moment moment, Proof& proof);
    [[nodiscard]] std::optional<Response> refuse_stream(const RequestHead& head, const Client& client,
                                                        Moment moment);
    [[nodiscard]] Plan plan_file(const RequestHead& head) const;
    [[nodiscard]] Plan plan_route(const RequestHead& head, const api::Match& match, const Client& client,
                                  Moment moment);
    [[nodiscard]] Plan admit_upload(const RequestHead& head, Result<std::unique_ptr<Upload>> upload);
    [[nodiscard]] static Response refused_upload(const Error& error);
    void analyze(std::shared_ptr<Upload> upload, std::shared_ptr<const Request> request, Moment moment,
                 Reply reply);
    [[nodiscard]] Response queue_upload(Upload& upload, const spool::Analysis& analysis,
                                        const Request& request, Moment moment);
    void send(const Reply& reply, Response response);

    ServiceOptions options_;
    api::Context context_;
    Authenticator authenticator_;
    StaticFiles files_;
    spool::Analyzer& analyzer_;
    Executors executors_;
    LiveHub live_;
    Metrics counts_nothing_;
    std::vector<std::weak_ptr<Upload>> uploads_;  // under way, and some that have ended
};

}  // namespace qduino::web
