#include "apps/qduino/sketch_folder.h"

#include <algorithm>
#include <system_error>

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

bool is_tab(const fs::path& path) { return path.extension() == ".ino" || path.extension() == ".pde"; }

bool is_source(const fs::path& path) {
    return path.extension() == ".cpp" || path.extension() == ".cc" || path.extension() == ".c";
}

/// Editors leave hidden and backup files behind.
bool is_hidden(const fs::path& path) { return path.filename().string().starts_with("."); }

template <typename Iterator, typename Wanted>
void collect(Iterator entries, Wanted wanted, std::vector<fs::path>& files) {
    for (const fs::directory_entry& entry : entries) {
        if (entry.is_regular_file() && !is_hidden(entry.path()) && wanted(entry.path()))
            files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
}

Sketch whole_folder(const fs::path& folder) {
    Sketch sketch{.name = folder.filename().string(), .folder = folder, .tabs = {}, .sources = {}};
    collect(fs::directory_iterator(folder), is_tab, sketch.tabs);
    std::stable_partition(sketch.tabs.begin(), sketch.tabs.end(),
                          [&](const fs::path& tab) { return tab.stem() == sketch.name; });
    std::vector<fs::path> deeper;
    if (fs::is_directory(folder / "src"))
        collect(fs::recursive_directory_iterator(folder / "src"), is_source, deeper);
    collect(fs::directory_iterator(folder), is_source, sketch.sources);
    sketch.sources.insert(sketch.sources.end(), deeper.begin(), deeper.end());
    return sketch;
}

}  // namespace

Result<Sketch> find_sketch(const fs::path& argument) {
    std::error_code failed;
    const fs::path path = fs::canonical(argument, failed);
    if (failed) {
        return make_error(ErrorCode::not_found, "no such sketch: " + argument.string() +
                                                    " (a folder with an .ino in it, or an .ino)");
    }
    if (fs::is_directory(path)) {
        Sketch sketch = whole_folder(path);
        if (!sketch.tabs.empty()) return sketch;
        return make_error(ErrorCode::not_found,
                          "no .ino file in this folder ('qduino new NAME' makes a sketch): " + path.string());
    }
    if (!is_tab(path)) {
        return make_error(ErrorCode::invalid_argument,
                          "a sketch is a folder, or an .ino file; this is neither: " + argument.string());
    }
    Sketch sketch = whole_folder(path.parent_path());
    const bool alone = sketch.tabs.size() == 1;
    const bool main_tab = path.stem() == path.parent_path().filename();
    if (!alone && !main_tab)
        sketch = {.name = "", .folder = path.parent_path(), .tabs = {path}, .sources = {}};
    if (!main_tab) sketch.name = path.stem().string();
    return sketch;
}

}  // namespace qduino::apps
