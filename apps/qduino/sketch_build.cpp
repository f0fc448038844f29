#include "apps/qduino/sketch_build.h"

#include <fcntl.h>
#include <sys/file.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <system_error>

#include "apps/qduino/build_step.h"
#include "apps/qduino/words.h"
#include "posix/unique_fd.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

/// FNV-1a, 64 bits (Fowler, Noll, Vo): tells folders apart; no protection against an attacker.
std::uint64_t hash_of(const Words& words) {
    std::uint64_t hash = 0xcbf29ce484222325u;
    const auto mix = [&hash](unsigned char byte) { hash = (hash ^ byte) * 0x100000001b3u; };
    for (const std::string& word : words) {
        for (const char c : word) mix(static_cast<unsigned char>(c));
        mix(0);
    }
    return hash;
}

Result<fs::path> cache_root(const BuildEnvironment& environment) {
    // A relative $XDG_CACHE_HOME is to be ignored (XDG Base Directory Specification 0.8).
    if (environment.xdg_cache_home.starts_with('/')) return fs::path(environment.xdg_cache_home) / "qduino";
    if (!environment.home.empty()) return fs::path(environment.home) / ".cache" / "qduino";
    return make_error(ErrorCode::not_found,
                      "no folder for what is built: set HOME, or XDG_CACHE_HOME to an absolute path");
}

/// As the Arduino IDE compiles, leniently, but with the warnings that the IDE would hide. Warnings
/// in our own headers are hidden: they do not concern the user.
Words compile_flags(const Sdk& sdk, const Sketch& sketch) {
    Words words{"-O2", "-g1", "-Wall", "-fdiagnostics-color=always"};
    append(words, sdk.flags);
    for (const std::string& definition : sdk.definitions) words.push_back("-D" + definition);
    words.push_back("-I" + sketch.folder.string());
    for (const std::string& folder : sdk.include) {
        if (folder == "/usr/include") continue;  // is searched anyway, and must stay last
        append(words, {"-isystem", folder});
    }
    return words;
}

BuildStep compile_step(const Words& command, const fs::path& source, const fs::path& object,
                       const std::string& title) {
    BuildStep step{
        .title = title, .command = command, .inputs = {source}, .output = object, .depfile = object};
    step.depfile += ".d";
    append(step.command, {"-MD", "-MF", step.depfile.string(), "-c", source.string(), "-o", object.string()});
    return step;
}

}  // namespace

BuildEnvironment environment_of_this_process() {
    const auto value = [](const char* name) {
        const char* text = std::getenv(name);
        return std::string(text ? text : "");
    };
    return {.xdg_cache_home = value("XDG_CACHE_HOME"),
            .home = value("HOME"),
            .cxx = value("CXX"),
            .cc = value("CC"),
            .cxxflags = value("CXXFLAGS"),
            .cflags = value("CFLAGS"),
            .ldflags = value("LDFLAGS")};
}

Result<SketchBuild> SketchBuild::open(Sdk sdk, Sketch sketch, const BuildEnvironment& environment) {
    QDUINO_TRY_ASSIGN(const fs::path root, cache_root(environment));
    SketchBuild build(std::move(sdk), std::move(sketch));
    const Sdk& tools = build.sdk_;
    const Words cxx = environment.cxx.empty() ? tools.cxx : words_of(environment.cxx);
    const Words flags = compile_flags(tools, build.sketch_);

    build.compile_cxx_ = cxx;
    append(build.compile_cxx_, {"-std=gnu++20", "-fpermissive"});
    append(build.compile_cxx_, flags);
    append(build.compile_cxx_, words_of(environment.cxxflags));
    build.compile_c_ = environment.cc.empty() ? tools.cc : words_of(environment.cc);
    build.compile_c_.push_back("-std=gnu17");
    append(build.compile_c_, flags);
    append(build.compile_c_, words_of(environment.cflags));
    build.link_ = cxx;
    append(build.link_, {"-fdiagnostics-color=always"});
    append(build.link_, tools.flags);
    append(build.link_, words_of(environment.ldflags));

    Words key{build.sketch_.folder.string(), build.sketch_.name, tools.file.string()};
    for (const Words* words : {&build.compile_cxx_, &build.compile_c_, &build.link_}) append(key, *words);
    char hash[20];
    std::snprintf(hash, sizeof hash, "-%016llx", static_cast<unsigned long long>(hash_of(key)));
    build.folder_ = root / (build.sketch_.name + hash);
    build.generated_ = build.folder_ / "sketch.ino.cpp";
    return build;
}

fs::path SketchBuild::program(BoardKind board) const {
    return folder_ / (sketch_.name + "-" + name_of(board));
}

fs::path SketchBuild::object_of(const fs::path& source) const {
    fs::path object = source == generated_ ? folder_ / source.filename()
                                           : folder_ / "objects" / source.lexically_relative(sketch_.folder);
    object += ".o";
    return object;
}

std::vector<fs::path> SketchBuild::objects() const {
    std::vector<fs::path> objects{object_of(generated_)};
    for (const fs::path& source : sketch_.sources) objects.push_back(object_of(source));
    return objects;
}

Result<int> SketchBuild::make(const std::vector<BoardKind>& boards, bool verbose) const {
    std::error_code failed;
    fs::create_directories(folder_, failed);
    const posix::UniqueFd lock{::open((folder_ / ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644)};
    if (failed || !lock.valid() || ::flock(lock.get(), LOCK_EX) != 0) {
        return make_error(ErrorCode::not_permitted,
                          "cannot write here; set XDG_CACHE_HOME to a folder of yours: ", folder_.native());
    }
    return make_locked(boards, verbose);
}

Result<int> SketchBuild::make_locked(const std::vector<BoardKind>& boards, bool verbose) const {
    BuildStep join{.title = "Joining " + sketch_.name + ".ino",
                   .command = {sdk_.python, sdk_.ino_to_cpp.string()},
                   .inputs = sketch_.tabs,
                   .output = generated_,
                   .depfile = {}};
    join.inputs.push_back(sdk_.ino_to_cpp);
    for (const fs::path& tab : sketch_.tabs) join.command.push_back(tab.string());
    append(join.command, {"-o", generated_.string()});

    std::vector<BuildStep> compiling{
        compile_step(compile_cxx_, generated_, object_of(generated_), "Compiling " + sketch_.name + ".ino")};
    for (const fs::path& source : sketch_.sources) {
        const Words& command = source.extension() == ".c" ? compile_c_ : compile_cxx_;
        compiling.push_back(compile_step(command, source, object_of(source),
                                         "Compiling " + source.lexically_relative(sketch_.folder).string()));
    }

    std::vector<BuildStep> linking;
    for (const BoardKind board : boards) {
        BuildStep step{.title = "Linking " + program(board).filename().string(),
                       .command = link_,
                       .inputs = objects(),
                       .output = program(board),
                       .depfile = {}};
        const Sdk::Linking& with = sdk_.linking(board);
        for (const fs::path& object : step.inputs) step.command.push_back(object.string());
        step.command.emplace_back("-Wl,--start-group");
        append(step.command, with.libraries);
        step.command.emplace_back("-Wl,--end-group");
        append(step.command, with.options);
        append(step.command, {"-o", step.output.string()});
        for (const std::string& library : with.libraries) {
            if (library.starts_with('-')) continue;
            if (!fs::exists(library)) {
                return make_error(ErrorCode::not_found,
                                  "QduinoMC is not built whole; there, run 'cmake --build --preset release "
                                  "--target qduino'. Missing: ",
                                  library);
            }
            step.inputs.emplace_back(library);
        }
        linking.push_back(std::move(step));
    }

    int made = 0;
    for (const std::vector<BuildStep>& steps : {std::vector<BuildStep>{join}, compiling, linking}) {
        QDUINO_TRY_ASSIGN(const StepsDone done, run_steps(steps, verbose));
        if (done.failed) return make_error(ErrorCode::invalid_argument, sketch_.name, " is not built");
        made += done.made;
    }
    return made;
}

}  // namespace qduino::apps
