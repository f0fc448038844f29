#include "apps/name/announcer.h"

#include <avahi-common/error.h>
#include <avahi-common/malloc.h>
#include <avahi-common/simple-watch.h>
#include <avahi-core/core.h>
#include <avahi-core/log.h>
#include <avahi-core/publish.h>

namespace qduino::name {

struct Announcer::Parts {
    std::string name;
    std::uint16_t port = 0;
    std::function<void(Event)> on_event;
    AvahiSimplePoll* poll = nullptr;
    AvahiServer* server = nullptr;
    AvahiSEntryGroup* group = nullptr;

    ~Parts() {
        if (server) avahi_server_free(server);  // says goodbye
        if (poll) avahi_simple_poll_free(poll);
    }
    /// The name is ours: the service is told with it.
    void publish(AvahiServer* from) {
        server = from;  // the first call comes from within avahi_server_new()
        if (!group) group = avahi_s_entry_group_new(server, ignore_group, nullptr);
        if (group && avahi_s_entry_group_is_empty(group)) {
            const std::string title = "QduinoMC printer " + name;
            avahi_server_add_service(server, group, AVAHI_IF_UNSPEC, AVAHI_PROTO_UNSPEC, AvahiPublishFlags{},
                                     title.c_str(), "_https._tcp", nullptr, nullptr, port, "path=/", nullptr);
            avahi_s_entry_group_commit(group);
        }
        on_event(Event::announced);
    }
    static void ignore_group(AvahiServer*, AvahiSEntryGroup*, AvahiEntryGroupState, void*) {}
    static void on_state(AvahiServer* from, AvahiServerState state, void* self) {
        Parts& parts = *static_cast<Parts*>(self);
        if (state == AVAHI_SERVER_RUNNING) parts.publish(from);
        if (state == AVAHI_SERVER_COLLISION) parts.on_event(Event::taken);
        if (state == AVAHI_SERVER_FAILURE) parts.on_event(Event::failed);
    }
};

Announcer::Announcer(std::string name, std::uint16_t port, std::function<void(Event)> on_event)
    : parts_(std::make_unique<Parts>()) {
    parts_->name = std::move(name);
    parts_->port = port;
    parts_->on_event = std::move(on_event);
}

Announcer::~Announcer() = default;

Result<void> Announcer::start() {
    // It tells of each interface and each packet that a network did not take; on_event is enough.
    avahi_set_log_function([](AvahiLogLevel, const char*) {});
    parts_->poll = avahi_simple_poll_new();
    if (!parts_->poll) return make_error(ErrorCode::internal, "no memory");
    AvahiServerConfig config;
    avahi_server_config_init(&config);
    avahi_free(config.host_name);
    config.host_name = avahi_strdup(parts_->name.c_str());
    config.publish_hinfo = 0;
    config.publish_workstation = 0;
    config.publish_domain = 0;
    config.publish_aaaa_on_ipv4 = 1;
    config.use_ipv6 = 1;
    int failed = 0;
    parts_->server = avahi_server_new(avahi_simple_poll_get(parts_->poll), &config, Parts::on_state,
                                      parts_.get(), &failed);
    avahi_server_config_free(&config);
    if (parts_->server) return {};
    return make_error(ErrorCode::unavailable, "multicast DNS: ", avahi_strerror(failed));
}

void Announcer::run(int stop) {
    const AvahiPoll* poll = avahi_simple_poll_get(parts_->poll);
    AvahiWatch* watch = poll->watch_new(
        poll, stop, AVAHI_WATCH_IN,
        [](AvahiWatch*, int, AvahiWatchEvent, void* self) { static_cast<Announcer*>(self)->stop(); }, this);
    while (avahi_simple_poll_iterate(parts_->poll, -1) == 0) {
    }
    poll->watch_free(watch);
}

void Announcer::stop() { avahi_simple_poll_quit(parts_->poll); }

}  // namespace qduino::name
