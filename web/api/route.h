// A route: everything that the service knows of an endpoint, in one row of a table.
//
//   method  pattern            handler        thread       guard           body
//   POST    /api/v1/session    begin_session  Thread::io   Guard::login    Body::collect
//
// A new endpoint is a handler and a row beside it (docs/adding.md). docs/api.md lists the rows; a
// test compares.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "printer/machine_config.h"
#include "spool/spool.h"
#include "web/api/answers.h"
#include "web/http/http.h"

namespace qduino::web {
class Authenticator;
class Metrics;
class Upload;
}  // namespace qduino::web

namespace qduino::web::api {

/// Everything a handler may use.
struct Context {
    spool::Spool& spool;
    printer::MachineConfig machine;  ///< for refusing early, and for what other programs ask
    std::string config_json;         ///< answer to GET /api/v1/config
    std::string version;
    /// Judges one line of G-code before it is sent; empty: the machine alone judges.
    std::function<Result<void>(std::string_view)> check_line;
    Authenticator* authenticator = nullptr;  ///< the service's own, for routes of the I/O thread
    Metrics* metrics = nullptr;              ///< null: nothing is counted
    /// What holds this service to its budget, and what it has used, JSON; empty: nobody knows.
    std::function<std::string()> own_vcpu_json = nullptr;
    /// "https://192.168.1.5:8080": where others on the network come; empty: only this computer can.
    std::function<std::string()> network_address = nullptr;
    /// Rows of modules ("1101…") for a text; empty: nobody draws one.
    std::function<std::vector<std::string>(std::string_view)> qr_code = nullptr;
};

/// The second half of an answer, run on the spool's thread: its response is the one that is sent.
using Later = std::function<Response(Context&)>;

struct Call {
    const Request& request;
    /// The parts of the path that the pattern's `*`s stand for. After an upload: the new job's id.
    std::vector<std::string> arguments;
    spool::UnixSeconds now_s = 0;
    Instant now{};
    /// Set for routes of the I/O thread: a handler that needs the spool leaves the rest to it.
    Later* later = nullptr;
};

using Handler = Response (*)(Context&, const Call&);

/// Makes the receiver of an upload's body from its head. `arguments` as in Call.
using UploadOpener = Result<std::unique_ptr<Upload>> (*)(spool::Files&, const RequestHead&,
                                                         const std::vector<std::string>& arguments);

/// The thread that answers: the spool's, one request at a time; or the I/O thread, which must not
/// wait for it.
enum class Thread : std::uint8_t { spool, io };

/// What a request must show before it is looked at.
enum class Guard : std::uint8_t {
    key,     ///< the key, or a session's cookie from our own page
    login,   ///< nothing, from our own page: the body shows the key
    ticket,  ///< a live ticket, or as `key`, from our own page
    /// The key; or nothing, from an address that has shown it within the last minute, and from no
    /// browser: a page of any site can make one ask for any address.
    address,
    none,
};

/// What becomes of a request's body.
enum class Body : std::uint8_t {
    collect,  ///< it is kept whole for the handler
    upload,   ///< it goes to the disk piece by piece; the handler answers once the job is queued
    live,     ///< none: the connection becomes a live stream, without a handler
    none,     ///< none: the handler answers from the head alone
};

struct Route {
    Method method;
    /// "/api/v1/jobs/*/start"; `*` is one whole segment, a last `**` all that are left.
    std::string_view pattern;
    Handler handler = nullptr;
    Thread thread = Thread::spool;
    Guard guard = Guard::key;
    Body body = Body::collect;
    UploadOpener open = nullptr;  ///< for Body::upload
};

[[nodiscard]] constexpr Route upload_route(Method method, std::string_view pattern, Handler created,
                                           UploadOpener open) {
    return {method, pattern, created, Thread::spool, Guard::key, Body::upload, open};
}

/// The tables of all dialects, each from a file of its own, in the order in which they are tried.
[[nodiscard]] std::span<const std::span<const Route>> all_routes();

struct Match {
    const Route* route = nullptr;  ///< null: no such path, or no such method on it
    std::vector<std::string> arguments;
    bool path_known = false;
    /// The route's. For a known path with another method: none, or the key.
    Guard guard = Guard::key;
};
/// HEAD is answered as GET is, but is no live stream.
[[nodiscard]] Match find_route(const RequestHead& head);

/// Sends lines of G-code to the machine, if `check_line` accepts each of them.
[[nodiscard]] Result<void> send_checked(Context& context, const std::vector<std::string>& lines);

/// A handler that is one call of the spool.
template <Result<void> (spool::Spool::*kAct)(), Response (*kDone)() = accepted>
Response act(Context& context, const Call&) {
    return answer((context.spool.*kAct)(), kDone());
}

}  // namespace qduino::web::api
