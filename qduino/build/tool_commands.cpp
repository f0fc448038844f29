#include "qduino/build/tool_commands.h"

#include <algorithm>
#include <cstdlib>

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

/// As the Arduino IDE compiles, leniently, but with the warnings that the IDE would hide. Warnings
/// in our own headers are hidden: they do not concern the user. `while (!flag);` stays, as on an
/// AVR, also where the compiler may assume that it ends.
/// A `char` is signed on every computer, as on an AVR.
Words compile_flags(const Sdk& sdk, bool long_32) {
    Words words{"-O2", "-g1", "-Wall", "-fno-finite-loops", "-fsigned-char", "-fdiagnostics-color=always",
                // What nobody calls is left out by the linker, with what it would want in turn.
                "-ffunction-sections", "-fdata-sections"};
    append(words, sdk.flags);
    append(words, sdk.compiling);
    if (long_32) words.emplace_back("-DQDUINO_LONG_32");
    for (const std::string& definition : sdk.definitions) words.push_back("-D" + definition);
    for (const std::string& include : sdk.include) {
        if (include == "/usr/include") continue;  // is searched anyway, and must stay last
        append(words, {"-isystem", include});
    }
    return words;
}

/// Runs a tool of ours. To look for modules that somebody installed takes Python as long as to read
/// a small sketch: -S leaves that out, and -E what the environment says about it.
Words python_tool(const Sdk& sdk, const fs::path& tool) { return {sdk.python, "-E", "-S", tool.string()}; }

/// What stands before a compiler, so that it understands a sketch as an Arduino's does: `long` has
/// 32 bits. Our own headers and libraries are compiled already.
Words as_arduino(const Sdk& sdk, bool long_32) {
    Words words = python_tool(sdk, sdk.as_arduino);
    if (!long_32) append(words, {"--long", "64"});
    for (const std::string& folder : sdk.include) append(words, {"--keep", folder});
    append(words, {"--main", "refused", "--"});
    return words;
}

}  // namespace

BuildEnvironment environment_of_this_process() {
    const auto value = [](const char* name) {
        const char* text = std::getenv(name);
        return std::string(text ? text : "");
    };
    return {.xdg_cache_home = value("XDG_CACHE_HOME"),
            .home = value("HOME"),
            .qduino_libraries = value("QDUINO_LIBRARIES"),
            .cxx = value("CXX"),
            .cc = value("CC"),
            .cxxflags = value("CXXFLAGS"),
            .cflags = value("CFLAGS"),
            .ldflags = value("LDFLAGS"),
            .long_bits = value("QDUINO_LONG")};
}

Result<fs::path> cache_root(const BuildEnvironment& environment) {
    // A relative $XDG_CACHE_HOME is to be ignored (XDG Base Directory Specification 0.8).
    if (environment.xdg_cache_home.starts_with('/')) return fs::path(environment.xdg_cache_home) / "qduino";
    if (!environment.home.empty()) return fs::path(environment.home) / ".cache" / "qduino";
    return make_error(ErrorCode::not_found,
                      "no folder for what is built: set HOME, or XDG_CACHE_HOME to an absolute path");
}

ToolCommands tool_commands(const Sdk& sdk, const fs::path& folder, const BuildEnvironment& environment) {
    ToolCommands tools;
    const Words cxx = environment.cxx.empty() ? sdk.cxx : words_of(environment.cxx);
    const bool long_32 = environment.long_bits != "64";
    const Words flags = compile_flags(sdk, long_32);
    const std::string& own_headers = tools.own_headers = "-I" + folder.string();

    Words cpp = cxx;
    append(cpp, {"-std=gnu++20", "-fpermissive", "-Wno-error=narrowing"});
    // A function that ends without its return goes on in its caller, as on an AVR, and not with
    // what stands behind it: GCC 12 does that where its check of unreachable places is on
    // (cp/cp-gimplify.cc, cp_maybe_instrument_return).
    if (sdk.prepares_headers && environment.cxx.empty())
        append(cpp, {"-fsanitize=unreachable", "-fsanitize-undefined-trap-on-error"});
    append(cpp, flags);
    CompileCommands& compile = tools.compile;
    compile.cpp = compile.c = as_arduino(sdk, long_32);
    // Flags of the user's would each have 80 MB of their own.
    const auto cache = cache_root(environment);
    if (sdk.prepares_headers && long_32 && cache && environment.cxx.empty() && environment.cxxflags.empty()) {
        tools.headers.emplace(sdk, cpp, *cache);
        compile.cpp.insert(compile.cpp.end() - 1, {"--prepared", tools.headers->folder().string()});
    }
    append(compile.cpp, cpp);
    compile.cpp.push_back(own_headers);
    append(compile.cpp, words_of(environment.cxxflags));
    compile.assembler = environment.cc.empty() ? sdk.cc : words_of(environment.cc);
    append(compile.c, compile.assembler);
    compile.c.emplace_back("-std=gnu17");
    append(compile.c, flags);
    compile.c.push_back(own_headers);
    append(compile.c, words_of(environment.cflags));
    append(compile.assembler, {"-x", "assembler-with-cpp"});
    append(compile.assembler, flags);
    compile.assembler.push_back(own_headers);
    tools.link = cxx;
    append(tools.link, {"-fdiagnostics-color=always"});
    append(tools.link, sdk.flags);
    append(tools.link, words_of(environment.ldflags));
    return tools;
}

Words join_command(const Sdk& sdk, const Sketch& sketch, const fs::path& output) {
    Words command = python_tool(sdk, sdk.ino_to_cpp);
    for (const fs::path& tab : sketch.tabs) command.push_back(tab.string());
    append(command, {"-o", output.string()});
    return command;
}

Result<Words> link_command(const ToolCommands& tools, const Sdk::Linking& with, const Words& objects,
                           const Words& ldflags, const fs::path& output) {
    for (const std::string& library : with.libraries) {
        if (!library.starts_with('-') && !fs::exists(library)) {
            return make_error(ErrorCode::not_found,
                              "QduinoMC is not built whole; there, run 'cmake --build --preset release "
                              "--target qduino'. Missing: ",
                              library);
        }
    }
    Words command = tools.link;
    append(command, objects);
    command.emplace_back("-Wl,--start-group");
    append(command, with.libraries);
    command.emplace_back("-Wl,--end-group");
    append(command, with.options);
    // As the Arduino builder does. An image's script does not say what is to be kept.
    if (std::ranges::count(with.options, "-nostdlib") == 0) command.emplace_back("-Wl,--gc-sections");
    append(command, ldflags);
    append(command, {"-o", output.string()});
    return command;
}

}  // namespace qduino::apps
