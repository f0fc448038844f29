#include "board/linux/device_interrupts.h"

#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <optional>

#include "base/whole_number.h"
#include "posix/small_file.h"

namespace qduino::board::linux {

using posix::read_small_file;
namespace {

namespace fs = std::filesystem;

std::vector<std::string> entries(const std::string& folder) {
    std::vector<std::string> names;
    std::error_code error;
    for (fs::directory_iterator at{folder, error}, end; !error && at != end; at.increment(error)) {
        names.push_back(at->path().filename().string());
    }
    return names;
}

std::optional<int> number(std::string_view text) {
    while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back()))) text.remove_suffix(1);
    return whole_number<int>(text);
}

/// Words in the names of handlers, lower case.
std::vector<std::string_view> handler_words(DeviceClass device) {
    switch (device) {
        case DeviceClass::gpio:
            return {"gpio", "pinctrl"};
        case DeviceClass::i2c:
            return {"i2c", "smbus"};
        case DeviceClass::spi:
            return {"spi"};
        case DeviceClass::uart:
            return {"tty", "uart", "serial"};
        case DeviceClass::nic:
            return {"eth", "wlan", "enp", "eno"};
        case DeviceClass::disk:
            return {"ahci", "nvme", "mmc", "sdhci", "ata"};
        case DeviceClass::all:
            break;
    }
    return {};
}

/// The first folder, at the device or above it, that lists the device's interrupts.
void add_interrupts_of_device(const std::string& device, std::set<int>& irqs) {
    std::error_code error;
    for (fs::path at = fs::canonical(device, error); !error && at.has_relative_path();
         at = at.parent_path()) {
        const std::vector<std::string> messages = entries((at / "msi_irqs").string());
        for (const std::string& irq : messages) {
            if (const auto value = number(irq)) irqs.insert(*value);
        }
        if (!messages.empty()) return;
        const auto text = read_small_file((at / "irq").string());
        const auto value = text ? number(*text) : std::nullopt;
        if (value && *value > 0) {
            irqs.insert(*value);
            return;
        }
    }
}

void add_by_sysfs(DeviceClass device, const std::string& root, std::set<int>& irqs) {
    const auto add_all = [&](const std::string& folder) {
        for (const std::string& name : entries(root + folder)) {
            add_interrupts_of_device(root + folder + "/" + name + "/device", irqs);
        }
    };
    if (device == DeviceClass::nic) add_all("/sys/class/net");
    if (device == DeviceClass::disk) add_all("/sys/block");
    if (device != DeviceClass::uart) return;
    for (const std::string& name : entries(root + "/sys/class/tty")) {
        const auto text = read_small_file(root + "/sys/class/tty/" + name + "/irq");
        const auto value = text ? number(*text) : std::nullopt;
        if (value && *value > 0) irqs.insert(*value);
    }
}

void add_by_handler(DeviceClass device, const std::string& root, std::set<int>& irqs) {
    for (const std::string& irq : entries(root + "/sys/kernel/irq")) {
        auto actions = read_small_file(root + "/sys/kernel/irq/" + irq + "/actions");
        if (!actions) continue;
        std::transform(actions->begin(), actions->end(), actions->begin(),
                       [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
        for (const std::string_view word : handler_words(device)) {
            if (actions->find(word) == std::string::npos) continue;
            if (const auto value = number(irq)) irqs.insert(*value);
        }
    }
}

}  // namespace

const char* name_of(DeviceClass device) {
    constexpr std::array kNames{"GPIO", "I2C", "SPI", "UART", "NIC", "DISK", "ALL"};
    return kNames[std::min(static_cast<std::size_t>(device), kNames.size() - 1)];
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
        if (const auto handlers = read_small_file(root + "/sys/kernel/irq/" + found.number + "/actions")) {
            found.handlers = handlers->substr(0, handlers->find('\n'));
            found.used = !found.handlers.empty();
        }
        all.push_back(std::move(found));
    }
    return all;
}

std::set<int> interrupts_of_class(DeviceClass device, const std::string& root) {
    std::set<int> irqs;
    if (device == DeviceClass::all) {
        for (const std::string& irq : entries(root + "/proc/irq")) {
            if (const auto value = number(irq)) irqs.insert(*value);
        }
        return irqs;
    }
    add_by_sysfs(device, root, irqs);
    add_by_handler(device, root, irqs);
    return irqs;
}

int route_class(MachineSettings& settings, DeviceClass device, int core, int cpus, bool allowed, int& stuck,
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
        if (settings.change(path, list.to_list())) {
            ++moved;
        } else {
            ++stuck;
        }
    }
    return moved;
}

std::vector<BottomHalf> bottom_halves_of(DeviceClass device, const std::string& root) {
    const std::set<int> irqs = interrupts_of_class(device, root);
    std::vector<BottomHalf> found;
    for (const std::string& entry : entries(root + "/proc")) {
        const auto tid = number(entry);
        const auto comm =
            tid ? read_small_file(root + "/proc/" + entry + "/comm") : Result<std::string>{Error{}};
        if (!comm) continue;
        const std::string name = comm->substr(0, comm->find('\n'));
        bool ours = false;
        if (name.rfind("irq/", 0) == 0) {  // irq/<number>-<handler>
            const auto irq = number(std::string_view{name}.substr(4, name.find('-') - 4));
            ours = irq && irqs.count(*irq) != 0;
        } else if (name.rfind("napi/", 0) == 0) {
            ours = device == DeviceClass::nic || device == DeviceClass::all;
        }
        if (ours) found.push_back({static_cast<pid_t>(*tid), name});
    }
    return found;
}

}  // namespace qduino::board::linux
