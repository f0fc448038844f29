// What a proxy says of its client: whatever the fields hold, what comes out can stand in a cookie
// and in an address, and a stranger's word changes nothing.
//
// Input: lines; the first byte of each says which field it is.
#include <cstdint>
#include <string>
#include <string_view>

#include "tests/fuzz/gcode/fuzz_check.h"
#include "web/http/forwarded.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace qduino::web;
    constexpr const char* kFields[] = {"X-Forwarded-For", "X-Forwarded-Proto", "X-Forwarded-Prefix", "Host"};
    RequestHead head;
    for (std::string_view rest{reinterpret_cast<const char*>(data), size};
         !rest.empty() && head.headers.size() < 100;) {
        const std::string_view line = take_until(rest, '\n');
        if (line.empty()) continue;
        head.headers.push_back(
            {kFields[static_cast<unsigned char>(line[0]) % 4], std::string{line.substr(1)}});
    }
    const Proxies proxies{{"127.0.0.1", "10.0.0.2", "::1"}};
    const Client client = proxies.client_of(head, {"127.0.0.1", false});
    FUZZ_EXPECT(!client.name.empty() && client.name.size() < 64);
    FUZZ_EXPECT(client.prefix.size() <= Proxies::kPrefixMax && !client.prefix.ends_with('/'));
    FUZZ_EXPECT(client.prefix.find_first_of("; \r\n,\"\\") == std::string::npos);
    FUZZ_EXPECT(client.prefix.find("//") == std::string::npos);
    const Client stranger = proxies.client_of(head, {"192.0.2.9", true});
    FUZZ_EXPECT(stranger.name == "192.0.2.9" && stranger.secure && stranger.prefix.empty());
    return 0;
}
