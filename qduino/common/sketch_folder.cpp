#include "qduino/common/sketch_folder.h"

#include <algorithm>
#include <string_view>
#include <system_error>

#include "posix/small_file.h"
#include "qduino/common/source_files.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

bool is_tab(const fs::path& path) { return path.extension() == ".ino" || path.extension() == ".pde"; }

Sketch whole_folder(const fs::path& folder) {
    Sketch sketch{.name = folder.filename().string(), .folder = folder, .tabs = {}, .sources = {}};
    sketch.tabs = files_in(folder, Depth::this_folder, is_tab);
    std::stable_partition(sketch.tabs.begin(), sketch.tabs.end(),
                          [&](const fs::path& tab) { return tab.stem() == sketch.name; });
    sketch.sources = sources_in(folder, Depth::this_folder);
    const std::vector<fs::path> deeper = sources_in(folder / "src", Depth::whole_tree);
    sketch.sources.insert(sketch.sources.end(), deeper.begin(), deeper.end());
    return sketch;
}

constexpr std::string_view kBegin = R"(: two loops, each with a budget of CPU time in every period.
//
//   qduino check      does every loop get its budget in time, even at worst?
//   qduino sim        runs it in virtual time
//   qduino run        runs it on this computer, in real time
//
// Plain numbers in loop(…) are milliseconds; 500us, 20ms and 2s work as well.

Channel<unsigned long> blinks;  // always the freshest value; neither side waits

void setup() {
  Serial.begin(115200);
  pinMode(LED_BUILTIN, OUTPUT);
  safeState(LED_BUILTIN, LOW);  // off when the sketch is gone, however it went
}

// loop(id, budget, period): 1 ms of CPU time in every 250 ms.
void loop(1, 1, 250) {
  static bool on = false;
  static unsigned long count = 0;
  on = !on;
  digitalWrite(LED_BUILTIN, on ? HIGH : LOW);
  if (on) blinks.write(++count);
  waitForNextPeriod();
}

// 5 ms in every second. However long it talks, loop 1 blinks on time.
void loop(2, 5, 1000) {
  Serial.print("blinks: ");
  Serial.println(blinks.read());
  waitForNextPeriod();
}
)";

/// Tasks of Visual Studio Code. Messages of the compiler lead to the tabs, whose paths they have.
constexpr std::string_view kTasks = R"({
  "version": "2.0.0",
  "tasks": [
    {"label": "build", "type": "process", "command": "qduino",
     "args": ["build", "--compile-commands"], "options": {"cwd": "${workspaceFolder}"},
     "group": {"kind": "build", "isDefault": true},
     "problemMatcher": {
       "owner": "cpp", "fileLocation": ["autoDetect", "${workspaceFolder}"],
       "pattern": {
         "regexp": "^(.+?):(\\d+):(\\d+):\\s+(?:fatal\\s+)?(warning|error|note):\\s+(.*)$",
         "file": 1, "line": 2, "column": 3, "severity": 4, "message": 5}}},
    {"label": "check", "type": "process", "command": "qduino", "args": ["check"],
     "group": "test", "problemMatcher": []},
    {"label": "simulate", "type": "process", "command": "qduino", "args": ["sim"],
     "group": "test", "problemMatcher": []},
    {"label": "run", "type": "process", "command": "qduino", "args": ["run"], "problemMatcher": []},
    {"label": "upload", "type": "process", "command": "qduino", "args": ["upload"],
     "dependsOn": "build", "problemMatcher": []},
    {"label": "monitor", "type": "process", "command": "qduino", "args": ["monitor"],
     "isBackground": true, "problemMatcher": []}
  ]
}
)";
constexpr std::string_view kSettings = R"({
  "files.associations": {"*.ino": "cpp"}
}
)";

bool is_sketch_name(const std::string& name) {
    constexpr std::string_view kAllowed = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-.";
    return !name.empty() && name.size() <= 63 && name.front() != '.' && name.front() != '-' &&
           name.find_first_not_of(kAllowed) == std::string::npos;
}

}  // namespace

Result<Sketch> find_sketch(const fs::path& argument) {
    std::error_code failed;
    const fs::path path = fs::canonical(argument, failed);
    if (failed) {
        return make_error(ErrorCode::not_found, "no such sketch: ", argument.native(),
                          " (a folder with an .ino in it, or an .ino)");
    }
    if (fs::is_directory(path)) {
        Sketch sketch = whole_folder(path);
        if (!sketch.tabs.empty()) return sketch;
        return make_error(ErrorCode::not_found,
                          "no .ino file in this folder ('qduino new NAME' makes a sketch): ", path.native());
    }
    if (!is_tab(path)) {
        return make_error(ErrorCode::invalid_argument,
                          "a sketch is a folder, or an .ino file; this is neither: ", argument.native());
    }
    Sketch sketch = whole_folder(path.parent_path());
    const bool alone = sketch.tabs.size() == 1;
    const bool main_tab = path.stem() == path.parent_path().filename();
    if (!alone && !main_tab)
        sketch = {.name = "", .folder = path.parent_path(), .tabs = {path}, .sources = {}};
    if (!main_tab) sketch.name = path.stem().string();
    return sketch;
}

Result<fs::path> make_sketch(const fs::path& path) {
    fs::path folder = path.lexically_normal();
    if (!folder.has_filename()) folder = folder.parent_path();  // "blink/"
    const std::string name = folder.filename().string();
    if (!is_sketch_name(name)) {
        return make_error(
            ErrorCode::invalid_argument,
            "a sketch's name has letters, digits, _ - and ., begins with none of - and ., and has at "
            "most 63 characters; not '",
            name, "'");
    }
    std::error_code failed;
    if (fs::exists(fs::symlink_status(folder, failed))) {
        return make_error(ErrorCode::already_exists,
                          "exists already, and is left as it is; take another name: ", folder.native());
    }
    fs::create_directories(folder, failed);
    const fs::path ino = folder / (name + ".ino");
    if (failed || !posix::write_file(ino, text<std::string>("// ", name, kBegin)))
        return make_error(ErrorCode::not_permitted, "cannot be made: ", ino.native());
    fs::create_directories(folder / ".vscode", failed);
    QDUINO_TRY(posix::write_file(folder / ".vscode" / "tasks.json", kTasks));
    QDUINO_TRY(posix::write_file(folder / ".vscode" / "settings.json", kSettings));
    return ino;
}

}  // namespace qduino::apps
