#include "qduino/options.h"

#include "base/text.h"
#include "qduino/common/host_name.h"
#include "report/picture/picture_file.h"
#include "report/picture/schedule.h"

namespace qduino::apps {

void SketchOptions::declare(CLI::App& app) {
    add_option(app, "sketch", sketch, "Folder or .ino (default: this folder)", "[SKETCH]");
    app.add_flag("-v,--verbose", verbose, "Show the commands that build it");
}

void LengthOption::declare(CLI::App& app, const char* description) {
    add_option(app, "--for", seconds, description, "S")->check(positive_number());
}

void LengthOption::add_to(Words& words) const {
    if (seconds) add_words(words, "--for", Shortest{*seconds});
}

void BoardOption::declare(CLI::App& app) {
    add_option(app, "--board", file, "Board file (docs/board-file.md)", "FILE")->check(CLI::ExistingFile);
}

void BoardOption::add_to(Words& words) const {
    if (!file.empty()) add_words(words, "--board", file);
}

ReadBoardFile BoardOption::read() const { return file.empty() ? ReadBoardFile{} : read_board_file(file); }

void PinsOption::declare(CLI::App& app) {
    add_option(app, "--pins", file, "Virtual pins, as virtual-machine makes them", "FILE")
        ->check(CLI::ExistingFile);
}

void ReportOption::declare(CLI::App& app) {
    add_option(app, "--report", file, "Write the guarantees here, as JSON", "FILE");
}

void ReportOption::add_to(Words& words) const {
    if (!file.empty()) add_words(words, "--report", file);
}

void SimulatedOptions::declare(CLI::App& app) {
    board.declare(app);
    add_option(app, "--cores", cores, "Cores, 1 to 64 (default 2)", "N")->check(whole_number_within(1, 64));
    add_option(app, "--seed", seed, "Seed of what is random (default 1)", "N");
}

void SimulatedOptions::add_to(Words& words) const {
    board.add_to(words);
    if (cores) add_words(words, "--cores", *cores);
    if (seed) add_words(words, "--seed", *seed);
}

void PictureOptions::declare(CLI::App& app, const char* description) {
    CLI::Option* picture = add_option(app, "--picture", file, description, "FILE");
    add_option(app, "--from", from_s, "The picture begins at this second", "S")
        ->check(number_within(0.0, picture::kLatestStart))
        ->needs(picture);
    add_option(app, "--length", length_s, "It shows so many (default: it suits)", "S")
        ->check(number_within(1e-6, picture::kLongest))
        ->needs(picture);
}

void PictureOptions::add_to(Words& words) const {
    if (!file.empty()) add_words(words, "--picture", file);
    if (from_s) add_words(words, "--from", Shortest{*from_s});
    if (length_s) add_words(words, "--length", Shortest{*length_s});
}

Result<void> PictureOptions::check() const {
    return file.empty() ? Result<void>{} : picture::check_picture_name(file);
}

void ShownOptions::declare(CLI::App& app) {
    add_option(app, "--vcd", vcd, "Write what the pins did here, for GTKWave", "FILE");
    app.add_flag("--plain", plain, "No strips of blocks: for a screen reader");
}

void ShownOptions::add_to(Words& words) const {
    if (!vcd.empty()) add_words(words, "--vcd", vcd);
    if (plain) words.emplace_back("--plain");
}

void RealTimeOptions::declare(CLI::App& app) {
    app.add_flag("--isolate", isolate, "Empty the cores that loops own (root)");
    app.add_flag("--best-effort", best_effort, "Do not ask for real-time scheduling");
}

void RealTimeOptions::add_to(Words& words) const {
    if (isolate) words.emplace_back("--isolate");
    if (best_effort) words.emplace_back("--best-effort");
}

void ToOption::declare(CLI::App& app) {
    add_option(app, "--to", host, "Another computer, by ssh", "USER@HOST")
        ->check(CLI::Validator(host_error, "USER@HOST"));
}

}  // namespace qduino::apps
