#include "doctor/facts.h"

#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "base/parts.h"
#include "board/linux/kernel/host_settings.h"
#include "board/linux/kernel/kernel_text.h"
#include "posix/small_file.h"

namespace qduino::apps::doctor {
namespace {

using board::linux::CpuList;
namespace fs = std::filesystem;

std::string without_end(std::string text) {
    using namespace std::string_view_literals;
    text.resize(text.find_last_not_of("\0 \n\t"sv) + 1);
    return text;
}

/// The output of `gzip -dc`; nothing when gzip is missing or refuses the file.
std::optional<std::string> unpacked(const std::string& path) {
    std::FILE* const gzip = ::popen(("gzip -dc '" + path + "' 2>/dev/null").c_str(), "re");
    if (!gzip) return std::nullopt;
    Result<std::string> content = posix::read_to_end(::fileno(gzip), path);
    if (::pclose(gzip) != 0 || !content) return std::nullopt;
    return std::move(*content);
}

/// "CONFIG_HZ=250" lines; "# CONFIG_X is not set" are left out.
std::map<std::string, std::string> settings_of(const std::string& text) {
    std::map<std::string, std::string> settings;
    std::istringstream lines{text};
    for (std::string line; std::getline(lines, line);) {
        const std::size_t equals = line.find('=');
        if (!line.starts_with("CONFIG_") || equals == std::string::npos) continue;
        settings[line.substr(0, equals)] = line.substr(equals + 1);
    }
    return settings;
}

}  // namespace

Facts::Facts(std::string root) : root_(std::move(root)) {
    std::optional<std::string> config = text("/boot/config-" + release());
    if (!config && exists("/proc/config.gz")) config = unpacked(at("/proc/config.gz"));
    if (config) config_ = settings_of(*config);
}

std::optional<std::string> Facts::text(std::string_view path) const {
    auto read = posix::read_small_file(at(path));
    if (!read) return std::nullopt;
    return without_end(std::move(*read));
}

bool Facts::exists(std::string_view path) const { return ::access(at(path).c_str(), F_OK) == 0; }

std::vector<std::string> Facts::entries(std::string_view folder) const {
    std::vector<std::string> names;
    std::error_code error;
    for (fs::directory_iterator entry{at(folder), error}, end; !error && entry != end;
         entry.increment(error)) {
        names.push_back(entry->path().filename().string());
    }
    std::sort(names.begin(), names.end());
    return names;
}

CpuList Facts::cpus(std::string_view path) const { return board::linux::read_cpu_list(at(path)); }

std::optional<std::string> Facts::value_in(std::string_view path, std::string_view key) const {
    std::istringstream lines{text(path).value_or("")};
    for (std::string line; std::getline(lines >> std::ws, line);) {
        if (line.starts_with(key))
            return line.substr(std::min(line.find_first_not_of(" \t:", key.size()), line.size()));
    }
    return std::nullopt;
}

int Facts::core_count() const {
    const int online = cpus("/sys/devices/system/cpu/online").size();
    return online > 0 ? online : static_cast<int>(::sysconf(_SC_NPROCESSORS_ONLN));
}

int Facts::owned_core() const {
    for (const char* list : {"/sys/devices/system/cpu/isolated", "/sys/devices/system/cpu/nohz_full"}) {
        const CpuList apart = cpus(list);
        for (int core = 0; core < CpuList::kLimit; ++core) {
            if (apart.has(core)) return core;
        }
    }
    return core_count() > 1 ? 1 : -1;
}

std::string Facts::release() const { return text("/proc/sys/kernel/osrelease").value_or("unknown"); }

bool Facts::kernel_at_least(int major, int minor) const {
    return board::linux::release_at_least(release(), major, minor);
}

std::string Facts::architecture() const {
    if (const auto named = text("/proc/sys/kernel/arch")) return *named;  // since Linux 6.2
    utsname names{};
    return ::uname(&names) == 0 ? names.machine : "unknown";
}

std::string Facts::model() const {
    for (const char* path : {"/proc/device-tree/model", "/sys/class/dmi/id/product_name"}) {
        const auto name = text(path);
        if (name && !name->empty()) return *name;
    }
    return value_in("/proc/cpuinfo", "model name").value_or(architecture() + " computer");
}

std::optional<std::string> Facts::built_with(const std::string& name) const {
    if (!config_) return std::nullopt;
    const auto found = config_->find(name);
    return found == config_->end() ? std::string{} : found->second;
}

std::optional<std::string> Facts::boot_parameter(std::string_view name) const {
    std::istringstream words{text("/proc/cmdline").value_or("")};
    std::optional<std::string> value;
    for (std::string word; words >> word;) {  // the last one counts, as for the kernel
        if (word == name) value = "";
        if (word.starts_with(std::string{name} + '=')) value = word.substr(name.size() + 1);
    }
    return value;
}

/// A shell reads GRUB's file, and GRUB what that makes of it: a dollar sign needs three
/// backslashes, of which sed takes two for one.
std::string for_grub(std::string_view word) {
    std::string out;
    for (const char c : word) {
        if (c == '$') out += R"(\\\\\\)";
        out += c;
    }
    return out;
}

std::string Facts::boot_with(std::string_view parameter) const {
    const std::string word{parameter};
    for (const char* file : {"/boot/firmware/cmdline.txt", "/boot/cmdline.txt"}) {
        if (exists(file)) return "sudo sed -i '1s/$/ " + word + "/' " + file + " && sudo reboot";
    }
    if (exists("/etc/default/grub")) {
        std::string command = "sudo sed -i";
        for (const std::string_view each : parts(word, " "))
            command += " -e 's/^GRUB_CMDLINE_LINUX=\"/&" + for_grub(each) + " /'";
        return command + " /etc/default/grub && sudo update-grub && sudo reboot";
    }
    return "boot with the kernel parameter " + word;
}

bool Facts::runs(std::string_view process) const {
    for (const std::string& name : entries("/proc")) {
        if (name[0] < '0' || name[0] > '9') continue;
        if (text("/proc/" + name + "/comm") == process) return true;
    }
    return false;
}

std::optional<long long> Facts::limit(std::string_view name) const {
    const auto soft = value_in("/proc/self/limits", name);
    if (!soft) return std::nullopt;
    return soft->starts_with("unlimited") ? -1 : std::atoll(soft->c_str());
}

bool Facts::capable(int capability) const {
    const std::string set = value_in("/proc/self/status", "CapEff").value_or("0");
    const unsigned long long held = std::strtoull(set.c_str(), nullptr, 16);
    return ((held >> capability) & 1) != 0;
}

std::string some_of(const std::vector<std::string>& list, std::size_t most) {
    std::string words;
    const std::size_t shown = std::min(list.size(), most);
    for (std::size_t i = 0; i < shown; ++i) write(words, i == 0 ? "" : ", ", list[i]);
    if (shown < list.size()) write(words, " and ", list.size() - shown, " more");
    return words;
}

}  // namespace qduino::apps::doctor
