// An image of a few bytes, put into memory; and page tables, walked as a processor does.
#include "beside/beside_image.h"

#include <elf.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <optional>
#include <random>
#include <vector>

#include "beside/boot_line.h"

namespace qduino::apps::beside_linux::beside_image_test {
namespace {

using board::kImageAt;
using board::kImageBytes;
using Bytes = std::vector<std::uint8_t>;

constexpr std::uint64_t kLoadAt = 0x1000;  // in the file, and behind kImageAt in memory
constexpr std::size_t kFilled = 64;
constexpr Places kPlaces{.memory_at = 0x10000000, .page_at = 0x90000};

template <typename T>
void put(Bytes& bytes, std::size_t at, const T& value) {
    std::memcpy(bytes.data() + at, &value, sizeof value);
}

struct Note {
    Elf64_Nhdr head;
    char name[8];
    std::uint32_t at, size;
};

/// One part of kFilled bytes, 1, 2, 3 …, and kFilled zeroes; its last 16 bytes are the trampoline.
Bytes small_image() {
    constexpr std::size_t kNotes = 0x200;
    Bytes image(kLoadAt + kFilled);
    Elf64_Ehdr head{};
    std::memcpy(head.e_ident, ELFMAG, SELFMAG);
    head.e_machine = EM_X86_64;
    head.e_phoff = sizeof head;
    head.e_phnum = 2;
    put(image, 0, head);
    put(image, sizeof head,
        Elf64_Phdr{.p_type = PT_LOAD,
                   .p_flags = 0,
                   .p_offset = kLoadAt,
                   .p_vaddr = 0,
                   .p_paddr = kImageAt + kLoadAt,
                   .p_filesz = kFilled,
                   .p_memsz = 2 * kFilled,
                   .p_align = 0});
    put(image, sizeof head + sizeof(Elf64_Phdr),
        Elf64_Phdr{.p_type = PT_NOTE,
                   .p_flags = 0,
                   .p_offset = kNotes,
                   .p_vaddr = 0,
                   .p_paddr = 0,
                   .p_filesz = 2 * sizeof(Note),
                   .p_memsz = 0,
                   .p_align = 0});
    put(image, kNotes, Note{{4, 12, 18}, "Xen", 0, 0});
    put(image, kNotes + 12 + 4 + 12,
        Note{{7, 8, board::kBesideNoteKind},
             "Qduino",
             static_cast<std::uint32_t>(kImageAt + kLoadAt + kFilled - 16),
             16});
    for (std::size_t i = 0; i < kFilled; ++i) image[kLoadAt + i] = static_cast<std::uint8_t>(i + 1);
    return image;
}

class BesideImage : public testing::Test {
  protected:
    Bytes memory_ = Bytes(kImageBytes, 0xee);
};

TEST_F(BesideImage, LiesWhereItIsLinkedForAndTheRestIsZero) {
    const auto trampoline = load_image(small_image(), memory_);
    ASSERT_TRUE(trampoline.ok()) << trampoline.error().message.view();
    Bytes expected(kImageBytes);
    for (std::size_t i = 0; i < kFilled; ++i) expected[kLoadAt + i] = static_cast<std::uint8_t>(i + 1);
    EXPECT_EQ(std::memcmp(memory_.data(), expected.data(), kImageBytes), 0);
    EXPECT_EQ(trampoline->size(), 16u);
    EXPECT_EQ(trampoline->data(), memory_.data() + kLoadAt + kFilled - 16);
}

TEST_F(BesideImage, WhatIsNoneIsRefused) {
    const Bytes good = small_image();
    const auto refused = [&](std::size_t at, auto value) {
        Bytes image = good;
        put(image, at, value);
        return !load_image(image, memory_).ok();
    };
    constexpr std::size_t kLoad = sizeof(Elf64_Ehdr);
    EXPECT_TRUE(refused(0, 'x'));
    EXPECT_TRUE(refused(offsetof(Elf64_Ehdr, e_machine), std::uint16_t{EM_AARCH64}));
    EXPECT_TRUE(refused(offsetof(Elf64_Ehdr, e_phoff), std::uint64_t{1} << 40));
    EXPECT_TRUE(refused(kLoad + offsetof(Elf64_Phdr, p_paddr), kImageAt - 1)) << "below its memory";
    EXPECT_TRUE(refused(kLoad + offsetof(Elf64_Phdr, p_memsz), kImageBytes)) << "too large";
    EXPECT_TRUE(refused(kLoad + offsetof(Elf64_Phdr, p_memsz), ~std::uint64_t{0}));
    EXPECT_TRUE(refused(kLoad + offsetof(Elf64_Phdr, p_filesz), std::uint64_t{kFilled + 1}))
        << "beyond the file";
    EXPECT_TRUE(refused(0x200 + 12 + 4 + 12 + 12, 'q')) << "another owner's note";
    EXPECT_FALSE(load_image(Bytes{}, memory_).ok());
    EXPECT_FALSE(load_image({good.data(), 300}, memory_).ok()) << "its end is missing";
}

/// Whatever the bytes say, nothing outside of the memory is read or written: the sanitizers look.
TEST_F(BesideImage, DamagedOnesStayInTheirMemory) {
    const auto seed = std::random_device{}();
    SCOPED_TRACE(seed);
    std::mt19937 dice{seed};
    const Bytes good = small_image();
    for (int round = 0; round < 15; ++round) {
        Bytes image = good;
        for (int i = 0; i < 4; ++i) image[64 + dice() % 560] = static_cast<std::uint8_t>(dice());
        const auto trampoline = load_image(image, memory_);
        if (!trampoline) continue;
        EXPECT_GE(trampoline->data(), memory_.data());
        EXPECT_LE(trampoline->data() + trampoline->size(), memory_.data() + memory_.size());
    }
}

// ---- page tables --------------------------------------------------------------------------------

class PageTables : public testing::Test {
  protected:
    PageTables() { map_memory(kPlaces, area_->tables); }

    /// The address in memory; nothing: a page fault. Intel SDM volume 3, figure 4-8 and 4-9.
    [[nodiscard]] std::optional<std::uint64_t> walk(std::uint64_t address) const {
        constexpr std::uint64_t kPresent = 1, kLarge = 0x80, kAddress = 0x000ffffffffff000;
        std::uint64_t table = kPlaces.memory_at + offsetof(board::BesideArea, tables);
        for (int level = 3; level >= 0; --level) {
            std::uint64_t entry = 0;
            const auto* const bytes = reinterpret_cast<const std::uint8_t*>(area_.get());
            std::memcpy(&entry, bytes + (table - kPlaces.memory_at) + 8 * (address >> (12 + 9 * level) & 511),
                        8);
            if ((entry & kPresent) == 0) return std::nullopt;
            const std::uint64_t within = address & ((std::uint64_t{1} << (12 + 9 * level)) - 1);
            if (level == 0 || (entry & kLarge) != 0) return (entry & kAddress) + within;
            table = entry & kAddress;
        }
        return std::nullopt;
    }

    std::unique_ptr<board::BesideArea> area_ = std::make_unique<board::BesideArea>();
};

/// Where an address leads, said in one sentence for each range.
std::optional<std::uint64_t> expected(std::uint64_t address) {
    const auto in = [address](std::uint64_t begin, std::uint64_t size) { return address - begin < size; };
    if (in(kImageAt, kImageBytes)) return address - kImageAt + kPlaces.memory_at + board::kImageOffset;
    if (in(kPlaces.memory_at, board::kBesideBytes) || in(kPlaces.page_at, 4096) || in(0xfee00000, 4096))
        return address;
    return std::nullopt;
}

TEST_F(PageTables, MapWhatIsTheBoardsAndNothingElse) {
    const auto seed = std::random_device{}();
    SCOPED_TRACE(seed);
    std::mt19937_64 dice{seed};
    std::vector<std::uint64_t> addresses{0,          8,         kPlaces.page_at, kImageAt, 0xfee00000 + 0x300,
                                         0xfec00000, 0xffffffff};
    for (const std::uint64_t edge :
         {kImageAt, kImageAt + kImageBytes, kPlaces.memory_at, std::uint64_t{kPlaces.page_at},
          kPlaces.memory_at + board::kBesideBytes, std::uint64_t{kPlaces.page_at} + 4096})
        addresses.insert(addresses.end(), {edge - 1, edge});
    for (int i = 0; i < 20'000; ++i) addresses.push_back(dice() & 0xffffffff);
    for (const std::uint64_t address : addresses) {
        const bool beside_the_apic = address >> 21 == 0xfee00000 >> 21 && address >> 12 != 0xfee00;
        if (beside_the_apic) continue;  // in its large page
        ASSERT_EQ(walk(address), expected(address)) << std::hex << address;
    }
    EXPECT_EQ(walk(std::uint64_t{1} << 32), std::nullopt);
    EXPECT_EQ(walk(std::uint64_t{1} << 39), std::nullopt);
}

TEST(Trampoline, IsToldWhatIsWhere) {
    const Bytes trampoline(40, 7);
    Bytes page(4096, 1);
    place_trampoline(trampoline, kPlaces, page);
    EXPECT_EQ(std::count(page.begin(), page.begin() + 32, 7), 32);
    EXPECT_EQ(std::count(page.begin() + 40, page.end(), 1), 4096 - 40);
    board::TrampolineEnd end;
    std::memcpy(&end, page.data() + 32, sizeof end);
    EXPECT_EQ(end.area_at, kPlaces.memory_at);
    EXPECT_EQ(end.tables_at, kPlaces.memory_at + offsetof(board::BesideArea, tables));
}

}  // namespace
}  // namespace qduino::apps::beside_linux::beside_image_test
