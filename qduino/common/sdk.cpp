#include "qduino/common/sdk.h"

#include <unistd.h>

#include <nlohmann/json.hpp>
#include <system_error>

#include "base/parts.h"
#include "posix/small_file.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr const char* kFileName = "qduino-sdk.json";

bool is_file(const fs::path& path) {
    std::error_code ignored;
    return fs::is_regular_file(path, ignored);
}

std::vector<std::string> parts_of(std::string_view whole, std::string_view separators) {
    const std::vector<std::string_view> found = parts(whole, separators);
    return {found.begin(), found.end()};
}

/// CMake's lists, joined with semicolons.
std::vector<std::string> list_of(const std::string& text) { return parts_of(text, ";"); }

/// The build's Python may be in another user's home, where this one cannot run it: then the one of
/// that name on the PATH.
std::string usable_python(const std::string& python) {
    return ::access(python.c_str(), X_OK) == 0 ? python : fs::path{python}.filename().string();
}

std::string resolved(const fs::path& folder, const std::string& item) {
    return item.empty() || item.front() == '-' ? item : (folder / item).lexically_normal().string();
}

Sdk::Linking linking_of(const Json& json, const fs::path& folder) {
    Sdk::Linking linking;
    for (const std::string item : json.at("libraries")) linking.libraries.push_back(resolved(folder, item));
    linking.options = json.at("options").get<std::vector<std::string>>();
    return linking;
}

void take_images(const Json& json, const fs::path& folder, Sdk& sdk) {
    sdk.metal = linking_of(json, folder);
    sdk.metal_flags = json.at("flags").get<std::vector<std::string>>();
    sdk.metal_script = resolved(folder, json.at("script"));
    sdk.no_metal = json.at("why_not");
}

Error damaged(const fs::path& file) {
    return make_error(ErrorCode::corrupt,
                      "is not what the build of QduinoMC writes; run cmake there again: ", file.native());
}

}  // namespace

const char* name_of(BoardKind board) {
    return board == BoardKind::sim ? "sim" : board == BoardKind::linux ? "linux" : "metal";
}

Sdk for_simulator(Sdk sdk) {
    sdk.compiling = sdk.sim_compiling;
    return sdk;
}

Sdk for_images(Sdk sdk) {
    sdk.flags = sdk.metal_flags;
    sdk.metal.options.push_back("-Wl,-T," + sdk.metal_script.string());
    return sdk;
}

Result<Sdk> for_aarch64_images(Sdk sdk) {
    const auto read = posix::read_small_file(sdk.metal_aarch64);
    if (!read)
        return make_error(
            ErrorCode::unavailable,
            "what images for aarch64 are linked with is not built. As root, run 'apt-get install "
            "g++-aarch64-linux-gnu', and then, in the tree of QduinoMC, 'cmake --build --preset "
            "release --target metal-aarch64'");
    try {
        const Json json = Json::parse(*read);
        take_images(json, sdk.metal_aarch64.parent_path(), sdk);
        sdk.cxx = {json.at("cxx")};
        sdk.cc = {json.at("cc")};
        return for_images(std::move(sdk));
    } catch (const Json::exception&) {
        return damaged(sdk.metal_aarch64);
    }
}

std::vector<std::string> words_of(std::string_view text) { return parts_of(text, " \t\n"); }

Result<fs::path> find_sdk(const SdkPlaces& places) {
    if (!places.home.empty()) {
        const fs::path home = places.home;
        for (const fs::path& path : {home, home / kFileName, home / "build" / "release" / kFileName}) {
            if (is_file(path)) return path;
        }
        return make_error(ErrorCode::not_found, "QDUINO_HOME names no built QduinoMC: no ", kFileName,
                          " in it, nor in its build/release. Unset it, or build there. It is ", places.home);
    }
    const fs::path beside = places.program.parent_path().parent_path() / kFileName;
    if (!places.program.empty() && is_file(beside)) return beside;
    if (is_file(places.built_in)) return places.built_in;
    return make_error(ErrorCode::not_found,
                      "the QduinoMC that this program belongs to is gone: set QDUINO_HOME to a tree in which "
                      "'cmake --preset release && cmake --build --preset release --target qduino' was run");
}

Result<Sdk> read_sdk(const fs::path& file) {
    const auto read = posix::read_small_file(file);
    const fs::path folder = fs::absolute(file).parent_path();
    try {
        const Json json = Json::parse(read ? *read : "");
        if (json.at("version") != 1)
            return make_error(ErrorCode::unsupported, "is of another version of QduinoMC: ", file.native());
        Sdk sdk;
        sdk.file = fs::absolute(file);
        sdk.cxx = {json.at("cxx")};
        sdk.cc = {json.at("cc")};
        sdk.prepares_headers = json.at("prepares_headers");
        sdk.flags = json.at("flags").get<std::vector<std::string>>();
        for (const std::string& item : list_of(json.at("include")))
            sdk.include.push_back(resolved(folder, item));
        sdk.definitions = list_of(json.at("definitions"));
        sdk.python = usable_python(json.at("python"));
        sdk.ino_to_cpp = resolved(folder, json.at("ino_to_cpp"));
        sdk.unpack_zip = resolved(folder, json.at("unpack_zip"));
        sdk.as_arduino = resolved(folder, json.at("as_arduino"));
        sdk.supervisor = resolved(folder, json.at("supervisor"));
        sdk.sim = linking_of(json.at("sim"), folder);
        sdk.sim_compiling = json.at("sim").at("compiling").get<std::vector<std::string>>();
        sdk.linux = linking_of(json.at("linux"), folder);
        take_images(json.at("metal"), folder, sdk);
        sdk.metal_aarch64 = resolved(folder, json.at("metal_aarch64"));
        return sdk;
    } catch (const Json::exception&) {
        return damaged(file);
    }
}

}  // namespace qduino::apps
