// SD: a memory card, which is a folder of the host. (API of Arduino's SD library.)
//
//   QDUINO_SD names the folder; else ~/.local/state/qduino/<program>.sd, which begin() makes
//   "/logs/a.txt" and "logs/a.txt" are the same file; ".." leads nowhere: a card has nothing above
//
// Names are as long as the host's, and kept as they are. Files are the kernel's, which may make a
// caller wait: use them in setup() or in a loop without a hard deadline. In the simulator they are
// the real ones. A real card on SPI has a driver of the kernel, and is mounted there.
#pragma once

#include <fcntl.h>

#include <memory>
#include <string>

#include "arduino/Stream.h"

// The library's words for what the C library calls otherwise.
#define O_READ O_RDONLY
#define O_WRITE O_WRONLY
#define FILE_READ O_READ
#define FILE_WRITE (O_RDWR | O_CREAT | O_APPEND)

namespace qduino::arduino::host {
struct OpenFile;
}

/// An open file or folder; copies share it. One that is false takes nothing and gives nothing.
class File : public Stream {
  public:
    File() = default;
    explicit File(std::shared_ptr<qduino::arduino::host::OpenFile> file) : file_(std::move(file)) {}

    std::size_t write(std::uint8_t value) override { return write(&value, 1); }
    std::size_t write(const std::uint8_t* buffer, std::size_t size) override;
    using Print::write;
    int available() override;
    int read() override;
    /// Returns how many bytes were read; −1: this is no file.
    int read(void* buffer, std::size_t size);
    int peek() override;
    /// What was written is on the disk.
    void flush() override;

    /// False, and nothing changed, beyond the end.
    bool seek(std::uint32_t position);
    [[nodiscard]] std::uint32_t position() const;
    [[nodiscard]] std::uint32_t size() const;
    void close() { file_.reset(); }
    operator bool() const { return file_ != nullptr; }
    /// The last part of its path.
    [[nodiscard]] const char* name() const;

    [[nodiscard]] bool isDirectory() const;
    /// The next entry of a folder, in the order of the names; a false file behind the last one.
    File openNextFile(int mode = FILE_READ);
    void rewindDirectory();

  private:
    std::shared_ptr<qduino::arduino::host::OpenFile> file_;
};

class SDClass {
  public:
    /// Setup-time. False, and reported, when there is no such folder and none can be made.
    bool begin(int chip_select = 10);
    bool begin(std::uint32_t /*clock*/, int chip_select) { return begin(chip_select); }
    void end() { root_.clear(); }

    /// A false file: there is none, or it cannot be opened so.
    File open(const char* path, int mode = FILE_READ);
    File open(const String& path, int mode = FILE_READ) { return open(path.c_str(), mode); }
    bool exists(const char* path);
    bool exists(const String& path) { return exists(path.c_str()); }
    /// Makes the folders above it as well.
    bool mkdir(const char* path);
    bool mkdir(const String& path) { return mkdir(path.c_str()); }
    /// Removes a file.
    bool remove(const char* path);
    bool remove(const String& path) { return remove(path.c_str()); }
    /// Removes an empty folder.
    bool rmdir(const char* path);
    bool rmdir(const String& path) { return rmdir(path.c_str()); }

  private:
    /// Where `path` lies in the host; empty: nowhere.
    [[nodiscard]] std::string place(const char* path) const;

    std::string root_;  // empty: not begun
};

extern SDClass SD;
