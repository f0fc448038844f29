#include "web/api/route.h"

#include <array>

namespace qduino::web::api {

// The table of each dialect, in the file of its name.
std::span<const Route> job_routes();
std::span<const Route> machine_routes();
std::span<const Route> octoprint_routes();
std::span<const Route> prusalink_routes();
std::span<const Route> moonraker_routes();
std::span<const Route> duet_routes();
std::span<const Route> service_routes();

std::span<const std::span<const Route>> all_routes() {
    static const std::array tables{job_routes(),       machine_routes(),   octoprint_routes(),
                                   prusalink_routes(), moonraker_routes(), duet_routes(),
                                   service_routes()};
    return tables;
}

Match find_route(const RequestHead& head) {
    Match match;
    for (const std::span<const Route> routes : all_routes()) {
        for (const Route& route : routes) {
            const bool head_of_get = head.method == Method::head && route.body != Body::live;
            const bool wanted = route.method == (head_of_get ? Method::get : head.method);
            std::vector<std::string> arguments;
            // For another method any name would be a known path.
            if (!wanted && route.pattern.ends_with(kRest)) continue;
            if (!fits_pattern(route.pattern, head.path, arguments)) continue;
            match.path_known = true;
            if (route.guard == Guard::none) match.guard = Guard::none;
            if (!wanted) continue;
            return {&route, std::move(arguments), true, route.guard};
        }
    }
    return match;
}

Result<void> send_checked(Context& context, const std::vector<std::string>& lines) {
    if (context.check_line)
        for (const std::string& line : lines) QDUINO_TRY(context.check_line(line));
    return context.spool.gcode(lines);
}

}  // namespace qduino::web::api
