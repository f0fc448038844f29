#include "board/linux/kernel/device_interrupts.h"

#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>

#include "base/whole_number.h"
#include "base/words.h"
#include "board/linux/kernel/kernel_text.h"

namespace qduino::board::linux {

namespace {

namespace fs = std::filesystem;

/// Words in the names of handlers, lower case, in the order of DeviceClass.
const std::array<std::vector<std::string_view>, kDeviceClassCount> kHandlerWords{{
    {"gpio", "pinctrl"},
    {"i2c", "smbus"},
    {"spi"},
    {"tty", "uart", "serial"},
    {"eth", "wlan", "enp", "eno"},
    {"ahci", "nvme", "mmc", "sdhci", "ata"},
}};

void add(std::string_view irq, std::set<int>& irqs) {
    if (const auto number = whole_number<int>(irq)) irqs.insert(*number);
}

/// The interrupt that the file at `path` names, if it is one. False: it names none.
bool add_named_by(const std::string& path, std::set<int>& irqs) {
    const int number = whole_number<int>(text_of_file(path)).value_or(0);
    if (number > 0) irqs.insert(number);
    return number > 0;
}

/// The first folder, at the device or above it, that lists the device's interrupts.
void add_interrupts_of_device(const std::string& device, std::set<int>& irqs) {
    std::error_code error;
    for (fs::path at = fs::canonical(device, error); !error && at.has_relative_path();
         at = at.parent_path()) {
        const std::vector<std::string> messages = entries(at / "msi_irqs");
        for (const std::string& irq : messages) add(irq, irqs);
        if (!messages.empty() || add_named_by(at / "irq", irqs)) return;
    }
}

void add_by_sysfs(DeviceClass device, const std::string& root, std::set<int>& irqs) {
    const auto add_all = [&](const std::string& folder) {
        for (const std::string& name : entries(folder))
            add_interrupts_of_device(folder + "/" + name + "/device", irqs);
    };
    if (device == DeviceClass::nic) add_all(root + "/sys/class/net");
    if (device == DeviceClass::disk) add_all(root + "/sys/block");
    if (device != DeviceClass::uart) return;
    for (const std::string& name : entries(root + "/sys/class/tty"))
        static_cast<void>(add_named_by(root + "/sys/class/tty/" + name + "/irq", irqs));
}

void add_by_handler(DeviceClass device, const std::string& root, std::set<int>& irqs) {
    for (const std::string& irq : entries(root + "/sys/kernel/irq")) {
        std::string actions = text_of_file(root + "/sys/kernel/irq/" + irq + "/actions");
        std::ranges::transform(actions, actions.begin(),
                               [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
        for (const std::string_view word : kHandlerWords[static_cast<std::size_t>(device)]) {
            if (actions.find(word) != std::string::npos) add(irq, irqs);
        }
    }
}

}  // namespace

std::string_view name_of(DeviceClass device) {
    constexpr Words<DeviceClass::gpio, DeviceClass::all> kNames{"GPIO", "I2C",  "SPI", "UART",
                                                                "NIC",  "DISK", "ALL"};
    return kNames(device);
}

std::vector<Interrupt> all_interrupts(const std::string& root) {
    std::vector<Interrupt> all;
    for (const int irq : interrupts_of_class(DeviceClass::all, root)) {
        Interrupt found;
        found.number = std::to_string(irq);
        const std::string folder = root + "/proc/irq/" + found.number;
        found.allowed = read_cpu_list(folder + "/smp_affinity_list");
        found.target = read_cpu_list(folder + "/effective_affinity_list");
        if (found.target.empty()) found.target = found.allowed;
        struct stat entry {};
        found.movable =
            ::stat((folder + "/smp_affinity_list").c_str(), &entry) == 0 && (entry.st_mode & S_IWUSR) != 0;
        if (const auto handlers =
                posix::read_small_file(root + "/sys/kernel/irq/" + found.number + "/actions")) {
            found.handlers = trimmed(*handlers);
            found.used = !found.handlers.empty();
        }
        all.push_back(std::move(found));
    }
    return all;
}

std::set<int> interrupts_of_class(DeviceClass device, const std::string& root) {
    std::set<int> irqs;
    if (device == DeviceClass::all) {
        for (const std::string& irq : entries(root + "/proc/irq")) add(irq, irqs);
        return irqs;
    }
    add_by_sysfs(device, root, irqs);
    add_by_handler(device, root, irqs);
    return irqs;
}

int route_class(HostSettings& settings, DeviceClass device, int core, int cpus, bool allowed, int& stuck,
                const std::string& root) {
    int moved = 0;
    stuck = 0;
    for (const int irq : interrupts_of_class(device, root)) {
        const std::string path = root + "/proc/irq/" + std::to_string(irq) + "/smp_affinity_list";
        CpuList list = read_cpu_list(path);
        if (list.empty() || list.has(core) == allowed) continue;
        if (allowed) {
            list.add(core);
        } else {
            list.remove(core);
            if (list.empty()) {  // it lived there alone: it goes to any other core
                list = CpuList::first(cpus);
                list.remove(core);
            }
        }
        ++(settings.change(path, list.to_list()) ? moved : stuck);
    }
    return moved;
}

std::vector<BottomHalf> bottom_halves_of(DeviceClass device, const std::string& root) {
    const std::set<int> irqs = interrupts_of_class(device, root);
    std::vector<BottomHalf> found;
    for (const std::string& entry : entries(root + "/proc")) {
        const auto tid = whole_number<pid_t>(entry);
        if (!tid) continue;
        const std::string name = text_of_file(root + "/proc/" + entry + "/comm");
        bool ours = false;
        if (name.starts_with("irq/")) {  // irq/<number>-<handler>
            const auto irq = whole_number<int>(std::string_view{name}.substr(4, name.find('-') - 4));
            ours = irq && irqs.contains(*irq);
        } else if (name.starts_with("napi/")) {
            ours = device == DeviceClass::nic || device == DeviceClass::all;
        }
        if (ours) found.push_back({*tid, name});
    }
    return found;
}

}  // namespace qduino::board::linux
