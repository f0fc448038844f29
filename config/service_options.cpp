#include "config/service_options.h"

#include "base/text.h"
#include "web/http/forwarded.h"
#include "web/net/certificate.h"

namespace qduino::apps {

void declare_service_options(CommandLine& line, ServiceOptions& options) {
    line.option("--name", options.name,
                "what the printer is called on the network: browsers may come to NAME and NAME.local")
        .called("NAME")
        .check([](const std::string& name) {
            const bool good = web::is_host_name(name) && name.find('.') == std::string::npos;
            return good ? "" : "give letters, digits and hyphens, not '" + name + "'";
        });
    line.option("--allow-host", options.hosts,
                "a name under which browsers may come, besides addresses and localhost")
        .called("NAME");
    line.option("--trust-proxy", options.trusted_proxies,
                "address of a proxy whose X-Forwarded-For, -Proto and -Prefix are believed")
        .called("ADDRESS")
        .check([](const std::string& address) {
            return web::is_numeric_address(address) ? ""
                                                    : "give an address as numbers, not '" + address + "'";
        });
    line.option("--tls-certificate", options.tls_certificate,
                "certificate to show, PEM, with its chain; without, one is made where others can connect")
        .called("FILE");
    line.option("--tls-key", options.tls_key, "its private key, PEM, without a password").called("FILE");
    line.option("--upload-limit-mib", options.upload_max_mib, "largest file accepted")
        .called("MIB")
        .shows_default()
        .within(1, 65536);
    line.option("--after-failure", options.after_failure, "what the queue does when a job has failed")
        .one_of({"hold", "continue"})
        .shows_default();
    line.flag("!--no-confirm-bed", options.confirm_bed,
              "start the next copy without asking whether the bed is clear (for an ejector)");
    line.flag("--prologue", options.prologue,
              "home and heat first, by [start] of the machine file, where an upload brings neither");
    line.option("--keep-jobs", options.keep_jobs, "ended jobs kept, with their files; 0: all")
        .called("N")
        .shows_default()
        .within(0, 100'000'000);
    line.option("--keep-days", options.keep_days, "days that an ended job is kept; 0: for ever")
        .called("DAYS")
        .shows_default()
        .within(0, 100'000);
    line.option("--store-limit-mib", options.store_max_mib,
                "what all stored files may take; the oldest ended jobs go first; 0: no limit")
        .called("MIB")
        .shows_default()
        .within(0, 1 << 30);
}

std::string problem_of(const ServiceOptions& options) {
    if (options.tls_certificate.empty() != options.tls_key.empty())
        return "--tls-certificate and --tls-key belong together";
    return {};
}

std::vector<std::string> words_of(const ServiceOptions& options) {
    std::vector<std::string> words;
    const auto add = [&words](const char* option, const std::string& value) {
        if (!value.empty()) words.insert(words.end(), {option, value});
    };
    const auto number = [](auto value) { return text<std::string>(value); };
    add("--name", options.name);
    for (const std::string& host : options.hosts) add("--allow-host", host);
    for (const std::string& proxy : options.trusted_proxies) add("--trust-proxy", proxy);
    add("--tls-certificate", options.tls_certificate);
    add("--tls-key", options.tls_key);
    add("--upload-limit-mib", number(options.upload_max_mib));
    add("--after-failure", options.after_failure);
    if (!options.confirm_bed) words.emplace_back("--no-confirm-bed");
    if (options.prologue) words.emplace_back("--prologue");
    add("--keep-jobs", number(options.keep_jobs));
    add("--keep-days", number(options.keep_days));
    add("--store-limit-mib", number(options.store_max_mib));
    return words;
}

}  // namespace qduino::apps
