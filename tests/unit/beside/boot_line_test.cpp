// What of Linux's boot line is good for a core beside it.
#include "beside/boot_line.h"

#include <gtest/gtest.h>

namespace qduino::apps::beside_linux::boot_line_test {
namespace {

const std::string kGood = "quiet memmap=184M$0x10000000 memmap=4K$0x90000 iomem=relaxed";

BootLine read(const std::string& words, int cores = 2, bool has_x2apic = false) {
    return read_boot_line({.cores = cores, .has_x2apic = has_x2apic, .boot_words = words});
}

TEST(BootLine, AGoodOneLacksNothing) {
    const BootLine line = read(kGood);
    EXPECT_EQ(line.memory_at, 0x10000000u);
    EXPECT_EQ(line.page_at, 0x90000u);
    EXPECT_EQ(joined(line.missing), "");
}

TEST(BootLine, AnEmptyOneIsToldAllWords) {
    EXPECT_EQ(joined(read("", 4, true).missing),
              "memmap=184M$0x10000000 memmap=4K$0x90000 iomem=relaxed nox2apic no_ipi_broadcast=1");
    EXPECT_EQ(joined(read("", 2, false).missing), "memmap=184M$0x10000000 memmap=4K$0x90000 iomem=relaxed");
}

TEST(BootLine, WordsThatTheComputerNeedsAreAskedFor) {
    EXPECT_EQ(joined(read(kGood, 2, true).missing), "nox2apic");
    EXPECT_EQ(joined(read(kGood, 3, false).missing), "no_ipi_broadcast=1");
    EXPECT_EQ(joined(read(kGood + " nox2apic no_ipi_broadcast=1", 8, true).missing), "");
    EXPECT_EQ(joined(read(kGood + " iomem=strict xnox2apic", 2, true).missing), "nox2apic");
}

TEST(BootLine, ARangeIsTakenAtTheNextLargePage) {
    EXPECT_EQ(read("memmap=186M$0x10000001").memory_at, 0x10200000u);
    EXPECT_EQ(read("memmap=185M$0x10000001").memory_at, 0u) << "too small from there on";
    EXPECT_EQ(read("memmap=1G$0").memory_at, 62u << 20) << "behind the addresses of the image";
    EXPECT_EQ(read("memmap=1G$0").page_at, 0x1000u) << "page 0 is nobody's";
}

TEST(BootLine, EveryWayToWriteANumberIsRead) {
    EXPECT_EQ(read("memmap=0xB800000$268435456").memory_at, 0x10000000u);
    EXPECT_EQ(read("memmap=4k$576K,184m$256M").memory_at, 0x10000000u);
    EXPECT_EQ(read("memmap=4k$576K,184m$256M").page_at, 0x90000u);
}

TEST(BootLine, WhatIsNotKeptFreeIsNotTaken) {
    for (const char* words :
         {"memmap=184M@0x10000000", "memmap=184M#0x10000000", "memmap=183M$0x10000000", "memmap=184M",
          "memmap=$0x10000000", "memmap=184M$", "memmap=184M$0xc0000000", "memmap=99999999999G$0x10000000",
          "xmemmap=184M$0x10000000", "memmap=-184M$0x10000000"})
        EXPECT_EQ(read(words).memory_at, 0u) << words;
    EXPECT_EQ(read("memmap=4K$0xff800").page_at, 0u) << "it would reach beyond 1 MiB";
}

}  // namespace
}  // namespace qduino::apps::beside_linux::boot_line_test
