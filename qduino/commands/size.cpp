// qduino size: how much memory a sketch takes, on the boards that a sketch is put on.
//
// The difficulty: a program has a megabyte before the sketch has a line, because the board, the
// Arduino functions and C's library are in it. Somebody who has made an array smaller wants to see
// that. So the objects of the sketch's own files have a row of their own, as they were before the
// linker left out what nobody calls.
//
// Facts: System V ABI, gABI chapter 4 (sections of an ELF file; AMD64: ELFCLASS64, little-endian).
#include <elf.h>

#include <cstdio>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/text.h"
#include "posix/small_file.h"
#include "qduino/built_sketch.h"
#include "qduino/command.h"
#include "terminal/human.h"
#include "terminal/message.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

/// Bytes in memory while it runs.
struct MemoryParts {
    std::uint64_t code = 0;    ///< and constants: what nobody writes to
    std::uint64_t data = 0;    ///< variables that begin with a value
    std::uint64_t zeroed = 0;  ///< those that begin with 0: they take no room in the file

    [[nodiscard]] std::uint64_t total() const { return code + data + zeroed; }
    void add(const MemoryParts& other) {
        code += other.code;
        data += other.data;
        zeroed += other.zeroed;
    }
};

template <typename Header>
std::optional<Header> header_at(std::string_view file, std::uint64_t at) {
    if (at > file.size() || file.size() - at < sizeof(Header)) return std::nullopt;
    Header header;
    std::memcpy(&header, file.data() + at, sizeof header);
    return header;
}

/// Adds what one section of an ELF file takes.
void take_section(const Elf64_Shdr& section, MemoryParts& parts) {
    if ((section.sh_flags & SHF_ALLOC) == 0) return;
    if ((section.sh_flags & SHF_WRITE) == 0)
        parts.code += section.sh_size;
    else if (section.sh_type == SHT_NOBITS)
        parts.zeroed += section.sh_size;
    else
        parts.data += section.sh_size;
}

/// What a program or an object takes. Error: it cannot be read, or is no ELF file of 64 bits.
Result<MemoryParts> parts_of(const fs::path& path) {
    QDUINO_TRY_ASSIGN(const std::string file, posix::read_small_file(path.native()));
    const auto head = header_at<Elf64_Ehdr>(file, 0);
    if (!head || std::memcmp(head->e_ident, ELFMAG, SELFMAG) != 0 || head->e_ident[EI_CLASS] != ELFCLASS64)
        return make_error(ErrorCode::corrupt, path.native(), " is no ELF file of 64 bits");
    MemoryParts parts;
    for (std::uint64_t i = 0; i < head->e_shnum; ++i) {
        const auto section = header_at<Elf64_Shdr>(file, head->e_shoff + i * head->e_shentsize);
        if (!section)
            return make_error(ErrorCode::corrupt, path.native(), " ends within its table of sections");
        take_section(*section, parts);
    }
    return parts;
}

/// What the sketch's own files take, and the libraries in its folder. Error: as parts_of().
Result<MemoryParts> parts_of_objects(const fs::path& folder) {
    MemoryParts parts;
    std::error_code failed;
    for (const auto& entry : fs::recursive_directory_iterator{folder, failed}) {
        if (entry.path().extension() != ".o") continue;
        QDUINO_TRY_ASSIGN(const MemoryParts object, parts_of(entry.path()));
        parts.add(object);
    }
    return parts;
}

/// A row of the table.
struct Row {
    std::string name;
    MemoryParts parts;
};

class Size final : public Command {
    void declare(CLI::App& app) override {
        sketch_.declare(app);
        app.add_flag("--json", json_, "As JSON, in bytes");
        board_.declare(app);
    }

    Result<int> run() override {
        const ReadBoardFile read = board_.read();
        if (!read.ok()) return say_failed(read.error);
        QDUINO_TRY_ASSIGN(const Sdk sdk, sdk_of_this_program());
        QDUINO_TRY_ASSIGN(const Sketch sketch, find_sketch(sketch_.sketch));
        QDUINO_TRY(measure(sdk, sketch, BoardKind::linux, "Linux"));
        const bool images = !sdk.metal.libraries.empty();
        if (images) QDUINO_TRY(measure(for_images(sdk), sketch, BoardKind::metal, "without Linux"));
        const std::size_t stack = read.board.linux.stack_bytes;
        if (json_) return print_json(stack), 0;
        print_table();
        std::printf(
            "On Linux each loop and handler has a stack of %s besides. Without Linux\n"
            "the stacks are among the zeroed bytes, and the heap is what is left.\n",
            size_text(stack).c_str());
        std::fflush(stdout);
        if (!images) say("No size without Linux: images cannot be built here. " + sdk.no_metal);
        say(verdict(sketch.name + " takes " + size_text(rows_[0].parts.total()) + " on Linux, " +
                    size_text(rows_[1].parts.total()) + " of it for its own files."));
        return 0;
    }

    /// Builds it for a board, and enters two rows: all of the program, and the sketch's own files.
    Result<void> measure(Sdk sdk, const Sketch& sketch, BoardKind board, const std::string& name) {
        QDUINO_TRY_ASSIGN(const SketchBuild build,
                          SketchBuild::open(std::move(sdk), sketch, environment_of_this_process()));
        QDUINO_TRY_ASSIGN(const int made, build.make({board}, sketch_.verbose));
        static_cast<void>(made);
        QDUINO_TRY_ASSIGN(const MemoryParts whole, parts_of(build.program(board)));
        QDUINO_TRY_ASSIGN(const MemoryParts own, parts_of_objects(build.folder()));
        rows_.push_back({name, whole});
        rows_.push_back({"  its own files", own});
        return {};
    }

    static std::string size_text(std::uint64_t bytes) {
        if (bytes < 10'000) return text<std::string>(bytes, " B");
        if (bytes < 10'000 * 1024ull) return text<std::string>(bytes / 1024, " KiB");
        return text<std::string>(bytes / 1024 / 1024, " MiB");
    }

    void print_table() const {
        std::string table = column("", -17) + column("code", 11) + column("data", 11) + column("zeroed", 11) +
                            column("together", 11) + '\n';
        for (const auto& [name, parts] : rows_) {
            table += column(name, -17);
            for (const std::uint64_t bytes : {parts.code, parts.data, parts.zeroed, parts.total()})
                table += column(size_text(bytes), 11);
            table += '\n';
        }
        std::fputs(table.c_str(), stdout);
    }

    void print_json(std::size_t stack) const {
        const auto object = [](const MemoryParts& parts) {
            return text<std::string>("{\"code\":", parts.code, ",\"data\":", parts.data,
                                     ",\"zeroed\":", parts.zeroed, "}");
        };
        const auto pair = [&](std::size_t at) {
            return at >= rows_.size() ? std::string{"null"}
                                      : "{\"program\":" + object(rows_[at].parts) +
                                            ",\"own_files\":" + object(rows_[at + 1].parts) + "}";
        };
        std::printf("{\"linux\":%s,\"metal\":%s,\"linux_stack\":%zu}\n", pair(0).c_str(), pair(2).c_str(),
                    stack);
    }

    SketchOptions sketch_;
    bool json_ = false;
    BoardOption board_;
    std::vector<Row> rows_;
};

const Listed<Size> size_listed{
    {Place::build, "size", "How much memory a sketch takes",
     "Builds it for Linux, and without Linux where that can be built, and says how\n"
     "many bytes are code and constants, variables with a value, and variables that\n"
     "begin with 0. Below each program stand the sketch's own files, as they were\n"
     "before the linker left out what nobody calls.\n"
     "Example: qduino size blinker --json"}};

}  // namespace
}  // namespace qduino::apps
