#include "qduino/ide/ide_recipe.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <system_error>

#include "posix/small_file.h"
#include "qduino/build/tool_commands.h"
#include "qduino/common/build_step.h"
#include "qduino/common/child_process.h"
#include "qduino/common/sketch_folder.h"
#include "terminal/message.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

/// `words` from the place `at` on, as a compiler takes them: libraries' folders are the system's to
/// it, as in `qduino build` (include_words()); other options are for the sketch's own files.
Words further_words(const Words& words, std::size_t at, bool own_file) {
    Words further;
    for (std::size_t i = at; i < words.size(); ++i) {
        if (words[i].starts_with("-I"))
            append(further, {"-isystem", words[i].substr(2)});
        else if (own_file)
            further.push_back(words[i]);
    }
    if (!own_file) further.emplace_back("-w");  // its author's business
    further.emplace_back("-fdiagnostics-color=never");
    return further;
}

bool is_below(const fs::path& path, const fs::path& folder) {
    const fs::path within = path.lexically_normal().lexically_relative(folder.lexically_normal());
    return !within.empty() && *within.begin() != "..";
}

/// The source that is compiled in the place of the builder's: of the tabs ours, else the same one.
Result<fs::path> source_to_compile(const Sdk& sdk, const fs::path& build, const fs::path& folder,
                                   const fs::path& source) {
    const bool tabs = source.parent_path() == build / "sketch" && source.stem().has_extension() &&
                      fs::exists(folder / source.stem());
    if (!tabs) return source;
    QDUINO_TRY_ASSIGN(const Sketch sketch, find_sketch(folder / source.stem()));
    const fs::path joined = build / "joined" / source.filename();
    std::error_code failed;
    fs::create_directories(joined.parent_path(), failed);
    QDUINO_TRY_ASSIGN(const int status, run_in_front(join_command(sdk, sketch, joined)));
    if (status != 0) return make_error(ErrorCode::invalid_argument, sketch.name, " cannot be joined");
    return joined;
}

/// BUILD FOLDER SOURCE OBJECT [OPTION…]
Result<int> compile_for_ide(const Sdk& sdk, const Words& words) {
    const fs::path build = words[0], folder = words[1], given = words[2], object = words[3];
    const bool own_file = is_below(given, build / "sketch");
    QDUINO_TRY_ASSIGN(const fs::path source, source_to_compile(sdk, build, folder, given));
    const ToolCommands tools = tool_commands(sdk, folder, environment_of_this_process());
    const posix::UniqueFd headers = tools.headers ? tools.headers->make(false) : posix::UniqueFd{};
    const fs::path depfile = fs::path(object).replace_extension(".d");
    Words command = tools.compile.for_source(source);
    append(command, further_words(words, 4, own_file));
    append(command, {"-MD", "-MF", depfile.string(), "-c", source.string(), "-o", object.string()});
    QDUINO_TRY_ASSIGN(const int status, run_in_front(command));
    if (status != 0) return status;
    Words others;
    for (const fs::path& file : dependencies_in(text_of(depfile))) others.push_back(file.string());
    QDUINO_TRY(posix::write_file(depfile, depfile_of(object, given, others)));
    return 0;
}

/// FOLDER SOURCE OUTPUT [OPTION…]
Result<int> preprocess_for_ide(const Sdk& sdk, const Words& words) {
    ToolCommands tools = tool_commands(sdk, words[0], environment_of_this_process());
    Words& cpp = tools.compile.cpp;
    // Not through as_arduino.py: the text is only looked at.
    cpp.erase(cpp.begin(), std::ranges::find(cpp, "--") + 1);
    append(cpp, further_words(words, 3, false));
    append(cpp, {"-x", "c++", "-E", "-CC", words[1], "-o", words[2]});
    ::setenv("LC_ALL", "C", 1);  // the builder reads "No such file or directory"
    return become(cpp);
}

/// The program that `words` name; they begin with BUILD NAME.
std::string program_of(const Words& words, BoardKind board) {
    return built_by_ide(fs::path(words[0]) / words[1], board);
}

/// BUILD NAME OBJECT…: archives of libraries are taken whole, as their objects would be.
Result<int> link_for_ide(const Sdk& sdk, const Words& words) {
    const ToolCommands tools = tool_commands(sdk, words[0], environment_of_this_process());
    Words objects, ldflags;
    for (const std::string& word : Words(words.begin() + 2, words.end())) {
        if (word.starts_with('-') && !is_harmless_flag(word))
            return make_error(ErrorCode::not_permitted, "a library asks for the linker's flag '",
                              without_controls(word), "', which could run a program");
        if (word.starts_with('-'))
            ldflags.push_back(word);
        else if (word.ends_with(".a") && fs::exists(word))
            append(objects, {"-Wl,--whole-archive", word, "-Wl,--no-whole-archive"});
        else if (!word.ends_with(".a"))  // the core's, in which there is nothing, was not made
            objects.push_back(word);
    }
    for (const BoardKind board : {BoardKind::linux, BoardKind::sim}) {
        QDUINO_TRY_ASSIGN(Words command, link_command(tools, sdk.linking(board), objects, ldflags,
                                                      program_of(words, board)));
        command.emplace_back("-fdiagnostics-color=never");
        QDUINO_TRY_ASSIGN(const int status, run_in_front(command));
        if (status != 0) return status;
    }
    return 0;
}

/// BUILD NAME: a refusal is no failure to build. Another computer may admit the sketch.
Result<int> check_for_ide(const Sdk&, const Words& words) {
    ::dup2(STDERR_FILENO, STDOUT_FILENO);  // the builder shows no other output
    QDUINO_TRY_ASSIGN(const int status, run_in_front({program_of(words, BoardKind::sim), "--check"}));
    if (status == 2) say("An upload to a computer like this would be refused.\n");
    return 0;
}

/// BUILD NAME
Result<int> size_for_ide(const Sdk&, const Words& words) {
    return become({"size", "-A", program_of(words, BoardKind::linux)});
}

struct Recipe {
    const char* name;
    std::size_t words;  ///< at least
    Result<int> (*run)(const Sdk&, const Words&);
};
constexpr std::array kRecipes{Recipe{"preprocess", 3, preprocess_for_ide},
                              Recipe{"compile", 4, compile_for_ide}, Recipe{"link", 3, link_for_ide},
                              Recipe{"check", 2, check_for_ide}, Recipe{"size", 2, size_for_ide}};

}  // namespace

bool is_recipe(const std::string& name) {
    return std::ranges::find(kRecipes, name, &Recipe::name) != kRecipes.end();
}

Result<int> run_recipe(const Sdk& sdk, const std::string& name, const Words& words) {
    const auto* const recipe = std::ranges::find(kRecipes, name, &Recipe::name);
    if (recipe == kRecipes.end() || words.size() < recipe->words) {
        return make_error(ErrorCode::invalid_argument, "'qduino ide ", name,
                          "' is for platform.txt, which has its words: 'qduino ide install' writes it");
    }
    return recipe->run(sdk, words);
}

fs::path built_by_ide(const fs::path& project, BoardKind board) {
    return project.parent_path() / (project.stem().string() + "-" + name_of(board));
}

Result<IdeProject> read_ide_project(const fs::path& project) {
    const fs::path file = project.parent_path() / "build.options.json";
    const nlohmann::json json = nlohmann::json::parse(text_of(file), nullptr, false);
    if (!json.is_object() || !json.contains("sketchLocation"))
        return make_error(ErrorCode::corrupt, "is not what the Arduino builder writes: ", file.native());
    std::string libraries =
        json.value("otherLibrariesFolders", "") + "," + json.value("builtInLibrariesFolders", "");
    std::ranges::replace(libraries, ',', ':');
    return IdeProject{json.value("sketchLocation", ""), libraries};
}

std::string depfile_of(const std::string& object, const std::string& source, const Words& others) {
    const auto escaped = [](const std::string& path) {
        std::string out;
        for (const char c : path) out += c == ' ' || c == '#' ? std::string{'\\', c} : std::string{c};
        return out;
    };
    std::string text = escaped(object) + ": \\\n " + escaped(source);
    for (const std::string& other : others) {
        if (other != source) text += " \\\n " + escaped(other);
    }
    return text + "\n";
}

}  // namespace qduino::apps
