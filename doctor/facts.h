// The computer as the checks see it: small files, words of the kernel's command line, and the way
// to boot this kind of computer differently. Reads on demand; keeps only the kernel's
// configuration.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "board/linux/kernel/cpu_list.h"

namespace qduino::apps::doctor {

class Facts {
  public:
    explicit Facts(std::string root);

    [[nodiscard]] std::string at(std::string_view path) const { return root_ + std::string{path}; }
    /// The whole file without white space (and NULs) at its end; nothing when it cannot be read.
    [[nodiscard]] std::optional<std::string> text(std::string_view path) const;
    [[nodiscard]] bool exists(std::string_view path) const;
    /// Names in a folder, sorted; none when there is no such folder.
    [[nodiscard]] std::vector<std::string> entries(std::string_view folder) const;
    /// A file with a list of CPUs; the empty list when it cannot be read or is none.
    [[nodiscard]] board::linux::CpuList cpus(std::string_view path) const;
    /// The value of `key` in a file of "key: value" lines; nothing when there is none.
    [[nodiscard]] std::optional<std::string> value_in(std::string_view path, std::string_view key) const;

    [[nodiscard]] int core_count() const;
    /// The core that a loop would own: the first that was set apart at boot (isolcpus, nohz_full),
    /// else core 1, as the sketches here name it; −1 when there is only one core.
    [[nodiscard]] int owned_core() const;
    /// owned_core() for use in texts and paths.
    [[nodiscard]] std::string owned_core_name() const { return std::to_string(owned_core()); }

    /// "6.1.0-50-rt-amd64".
    [[nodiscard]] std::string release() const;
    [[nodiscard]] bool kernel_at_least(int major, int minor) const;
    /// "x86_64", "aarch64" …
    [[nodiscard]] std::string architecture() const;
    /// The computer's name from its device tree, its firmware or its processor.
    [[nodiscard]] std::string model() const;
    [[nodiscard]] bool has_device_tree() const { return exists("/proc/device-tree/model"); }
    [[nodiscard]] bool is_raspberry_pi() const { return model().starts_with("Raspberry Pi"); }

    /// The value of `name` in the kernel's build ("y", "m", "250"); "" when it was not set; nothing
    /// when the configuration cannot be read (/boot/config-RELEASE or /proc/config.gz).
    [[nodiscard]] std::optional<std::string> built_with(const std::string& name) const;
    /// A parameter on the kernel's command line ("" when it has no value); nothing when it is not
    /// there.
    [[nodiscard]] std::optional<std::string> boot_parameter(std::string_view name) const;
    /// The command that adds `parameter` to the kernel's command line of this computer for the next
    /// boot.
    [[nodiscard]] std::string boot_with(std::string_view parameter) const;

    /// Is there a process of this name?
    [[nodiscard]] bool runs(std::string_view process) const;
    /// The soft limit in /proc/self/limits that begins with `name`; −1: unlimited; nothing: not
    /// readable.
    [[nodiscard]] std::optional<long long> limit(std::string_view name) const;
    /// Has this process the capability with that number (linux/capability.h)?
    [[nodiscard]] bool capable(int capability) const;

  private:
    std::string root_;
    std::optional<std::map<std::string, std::string>> config_;
};

/// `list` as people write it: "a, b and 3 more".
std::string some_of(const std::vector<std::string>& list, std::size_t most);

}  // namespace qduino::apps::doctor
