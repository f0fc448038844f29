#include "beside/beside_image.h"

#include <elf.h>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <optional>
#include <string_view>

#include "base/contract.h"
#include "beside/boot_line.h"

namespace qduino::apps::beside_linux {
namespace {

using board::BesideArea;
using board::kImageAt;
using board::kLargePage;
using Bytes = std::span<const std::uint8_t>;

constexpr std::uint64_t kLocalApic = 0xfee00000;

/// The part of `bytes`; nothing where it reaches beyond them.
std::optional<Bytes> part(Bytes bytes, std::uint64_t at, std::uint64_t size) {
    if (at > bytes.size() || size > bytes.size() - at) return std::nullopt;
    return bytes.subspan(at, size);
}

template <typename T>
std::optional<T> read_at(Bytes bytes, std::uint64_t at) {
    const auto from = part(bytes, at, sizeof(T));
    if (!from) return std::nullopt;
    T value;
    std::memcpy(&value, from->data(), sizeof value);
    return value;
}

Error not_an_image(std::string_view why) {
    return make_error(ErrorCode::corrupt, "this is no image that starts beside Linux: ", why,
                      ". 'qduino metal build' makes one");
}

/// One part of the file into memory.
Result<void> load(const Elf64_Phdr& header, Bytes image, std::span<std::uint8_t> memory) {
    const auto from = part(image, header.p_offset, header.p_filesz);
    const std::uint64_t at = header.p_paddr - kImageAt;
    if (!from || header.p_filesz > header.p_memsz || !part(memory, at, header.p_memsz))
        return not_an_image("a part of it lies outside of the memory for it");
    std::ranges::copy(*from, memory.begin() + static_cast<std::ptrdiff_t>(at));
    return {};
}

/// Where the trampoline is in `memory`, when this note says it.
std::optional<Bytes> trampoline_of(Bytes notes, Bytes memory) {
    struct Words {
        std::uint32_t at, size;
    };
    const auto padded = [](std::uint64_t size) { return (size + 3) / 4 * 4; };
    for (std::uint64_t at = 0;;) {
        const auto note = read_at<Elf64_Nhdr>(notes, at);
        if (!note) return std::nullopt;
        const std::uint64_t name_at = at + sizeof *note, words_at = name_at + padded(note->n_namesz);
        const auto name = part(notes, name_at, note->n_namesz);
        const auto words = read_at<Words>(notes, words_at);
        constexpr std::size_t kNameBytes = sizeof board::kBesideNoteName;
        if (name && words && note->n_type == board::kBesideNoteKind && name->size() == kNameBytes &&
            std::memcmp(name->data(), board::kBesideNoteName, kNameBytes) == 0)
            return part(memory, words->at - kImageAt, words->size);
        at = words_at + padded(note->n_descsz);
    }
}

}  // namespace

Result<Bytes> load_image(Bytes image, std::span<std::uint8_t> memory) {
    QDUINO_EXPECT(memory.size() == board::kImageBytes);
    const auto head = read_at<Elf64_Ehdr>(image, 0);
    if (!head || std::memcmp(head->e_ident, ELFMAG, SELFMAG) != 0 || head->e_machine != EM_X86_64)
        return not_an_image("it is not an ELF file for x86-64");
    std::ranges::fill(memory, std::uint8_t{0});
    std::optional<Bytes> notes;
    for (std::uint64_t i = 0; i < head->e_phnum; ++i) {
        const auto header = read_at<Elf64_Phdr>(image, head->e_phoff + i * sizeof(Elf64_Phdr));
        if (!header) return not_an_image("it ends too early");
        if (header->p_type == PT_LOAD) QDUINO_TRY(load(*header, image, memory));
        if (header->p_type == PT_NOTE) notes = part(image, header->p_offset, header->p_filesz);
    }
    const auto trampoline = notes ? trampoline_of(*notes, memory) : std::nullopt;
    if (!trampoline || trampoline->size() > kPage || trampoline->size() < sizeof(board::TrampolineEnd))
        return not_an_image("it says nothing of a trampoline");
    return *trampoline;
}

void map_memory(const Places& places, board::BesideTables& tables) {
    constexpr std::uint64_t kPresentWritable = 3, kUncached = 0x18, kLarge = 0x80;
    const std::uint64_t at = places.memory_at + offsetof(BesideArea, tables);
    const auto table_at = [at](std::size_t offset) { return (at + offset) | kPresentWritable; };
    const auto entry = [&tables](std::uint64_t address) -> std::uint64_t& {
        const std::uint64_t index = address / kLargePage;
        return tables.directories[index / 512][index % 512];
    };
    using Tables = board::BesideTables;
    tables = {};
    tables.map[0] = table_at(offsetof(Tables, pointers));
    for (std::size_t i = 0; i < tables.directories.size(); ++i)
        tables.pointers[i] = table_at(offsetof(Tables, directories) + i * kPage);
    tables.directories[0][0] = table_at(offsetof(Tables, first_pages));
    tables.first_pages[places.page_at / kPage] = places.page_at | kPresentWritable;
    for (std::uint64_t offset = 0; offset < board::kBesideBytes; offset += kLargePage)
        entry(places.memory_at + offset) = (places.memory_at + offset) | kPresentWritable | kLarge;
    for (std::uint64_t offset = 0; offset < board::kImageBytes; offset += kLargePage)
        entry(kImageAt + offset) =
            (places.memory_at + board::kImageOffset + offset) | kPresentWritable | kLarge;
    entry(kLocalApic) = (kLocalApic / kLargePage * kLargePage) | kPresentWritable | kLarge | kUncached;
}

void place_trampoline(Bytes trampoline, const Places& places, std::span<std::uint8_t> page) {
    QDUINO_EXPECT(trampoline.size() <= page.size());
    const board::TrampolineEnd end{
        .tables_at = static_cast<std::uint32_t>(places.memory_at + offsetof(BesideArea, tables)),
        .area_at = static_cast<std::uint32_t>(places.memory_at)};
    std::ranges::copy(trampoline, page.begin());
    std::memcpy(page.data() + trampoline.size() - sizeof end, &end, sizeof end);
}

}  // namespace qduino::apps::beside_linux
