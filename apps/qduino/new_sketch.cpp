#include "apps/qduino/new_sketch.h"

#include <fstream>
#include <string>
#include <system_error>

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

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

bool is_sketch_name(const std::string& name) {
    constexpr std::string_view kAllowed = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-.";
    return !name.empty() && name.size() <= 63 && name.front() != '.' && name.front() != '-' &&
           name.find_first_not_of(kAllowed) == std::string::npos;
}

}  // namespace

Result<fs::path> make_sketch(const fs::path& path) {
    fs::path folder = path.lexically_normal();
    if (!folder.has_filename()) folder = folder.parent_path();  // "blink/"
    const std::string name = folder.filename().string();
    if (!is_sketch_name(name)) {
        return make_error(
            ErrorCode::invalid_argument,
            "a sketch's name has letters, digits, _ - and ., begins with none of - and ., and has at "
            "most 63 characters; not '" +
                name + "'");
    }
    std::error_code failed;
    if (fs::exists(fs::symlink_status(folder, failed))) {
        return make_error(ErrorCode::already_exists,
                          "exists already, and is left as it is; take another name: " + folder.string());
    }
    fs::create_directories(folder, failed);
    const fs::path ino = folder / (name + ".ino");
    std::ofstream file(ino);
    file << "// " << name << kBegin;
    file.close();
    if (failed || !file) return make_error(ErrorCode::not_permitted, "cannot be made: " + ino.string());
    return ino;
}

}  // namespace qduino::apps
