// Every code that this printer knows, one row each: everything that the firmware knows of a code
// stands in its row.
//
//   {{'M', 104}, "hot end temperature", "STRIBF", hot_end, printing}
//    code        for people             letters   handler  when it may be typed
//
// The reader asks the row how to read the tail of a line. The interpreter asks it which letters are
// right and which handler to call. The machine asks it whether a person may type the code now.
// docs/gcode.md is printed from the rows.
//
// The dialect is Marlin's as slicers and hosts emit it, with Klipper's words. A code that is not in
// the table is unknown. A G-code or a word may stand for motion, so an unknown one is refused; any
// other is answered and skipped.
#pragma once

#include <compare>
#include <cstdint>
#include <span>
#include <string_view>

#include "base/result.h"
#include "printer/gcode/command.h"

namespace qduino::printer::gcode {

struct Context;

/// Carries out one command. It checks everything first and acts last: when it fails without having
/// moved, the interpreter restores the modal state. The interpreter puts line and code in front of
/// its error.
using Handler = Result<void>(Context& context, const Command& command);

/// The fate of a parameter that is not in `parameters`.
enum class Strictness : std::uint8_t {
    lenient,  ///< ignored, as Marlin does
    /// An error: codes that move or move the coordinates must say only what is understood.
    strict,
};

/// When a person may type the code. Each includes those above it.
enum class Typed : std::uint8_t {
    at_rest,   ///< only while no job runs and no fault is latched
    parked,    ///< also while a job is paused and the head waits beside the part: jogs
    printing,  ///< also while a job runs: nothing that moves, waits or changes how the job is read
    always,    ///< also while a fault is latched: questions, and the emergency stop
};

/// When a serial host is told `ok`. Marlin says it when the command has returned: a move returns
/// when the planner has it.
enum class Ok : std::uint8_t {
    at_once,     ///< as soon as the line has been taken: it can only change what later lines do
    when_done,   ///< it answers, or waits: when it has
    when_still,  ///< … and when all motion before it has been played
};

/// How the text behind the code is read.
enum class Tail : std::uint8_t {
    words,      ///< parameters: a letter, and mostly a number
    free_text,  ///< one text: a message, a file name, a version
    /// Parameters; what follows A is a name, in quotes or to the end of the line (`M486 Alid (2)`,
    /// as Prusa's slicer writes it). Its letters are no parameters.
    named,
    loose,  ///< parameters, where it reads as such; else it says nothing: a display fails no job
};

/// The key of a row.
struct Code {
    static constexpr std::int32_t kNoSubcode = -1;
    static constexpr std::int32_t kAnySubcode = -2;

    constexpr Code(char code_letter, std::uint32_t code_number, std::int32_t code_subcode = kNoSubcode)
        : letter(code_letter), number(code_number), subcode(code_subcode) {}
    /// A command that is a word, in upper case.
    constexpr Code(std::string_view code_word) : word{code_word} {}

    char letter = '\0';  ///< '\0': a word command
    std::uint32_t number = 0;
    std::int32_t subcode = kNoSubcode;
    std::string_view word{};

    friend constexpr auto operator<=>(const Code&, const Code&) = default;
};

struct CodeInfo {
    /// `options` are of Strictness, Typed, Tail and Ok, in any order. An option left out is the
    /// first of its kind.
    template <typename... Options>
    constexpr CodeInfo(Code its_code, std::string_view its_name, std::string_view its_parameters,
                       Handler* its_handler = nullptr, Options... options)
        : code(its_code), name(its_name), parameters(its_parameters), handler(its_handler) {
        (set(options), ...);
    }

    Code code;
    std::string_view name;        ///< what it does, for people: "linear move"
    std::string_view parameters;  ///< letters
    Handler* handler;             ///< null: changes no part; said by name, then skipped
    Strictness strictness = Strictness::lenient;
    Typed typed = Typed::at_rest;
    Tail tail = Tail::words;
    Ok ok = Ok::at_once;

  private:
    constexpr void set(Strictness option) { strictness = option; }
    constexpr void set(Typed option) { typed = option; }
    constexpr void set(Tail option) { tail = option; }
    constexpr void set(Ok option) { ok = option; }
};

/// All known codes, sorted by Code.
std::span<const CodeInfo> known_codes();

/// Null when unknown. A subcode that is not listed is unknown, except where every subcode is meant
/// (M862.x).
const CodeInfo* find_code(const Command& command);

/// True for a command that may stand for motion if its code is unknown: a word, a G, a tool, or a
/// place that a G1 of an earlier line is to be read into (RS-274's modal motion).
bool may_move(const Command& command);

/// True for a code that would change the part and is not done: a job that holds it is refused.
bool is_refused(const CodeInfo& code);

/// True for codes whose tail is one text, not words: M117, M118, M0 …
bool takes_free_text(char letter, std::uint32_t number);

/// True when the tail of `letter``number` must be words, or else the line is malformed: codes with
/// a handler, except those that take a text. A code that is skipped may have any tail (`M1002
/// action : 2`).
bool must_be_words(char letter, std::uint32_t number);

/// True for a code that `letter` may follow; for an unknown code as well.
bool takes_letter(char code, std::uint32_t number, char letter);

/// True for codes in whose tail A begins a name: M486.
bool ends_in_a_name(char letter, std::uint32_t number);

/// True for a word of the table, such as EXCLUDE_OBJECT_DEFINE: its text may be of any length, and
/// only the beginning counts. Any case.
bool is_known_word(std::string_view word);

/// When a person may type the code, whatever its subcode. An unknown code is answered at rest.
Typed may_be_typed(const Command& command);

/// When a serial host is told `ok`. For a code that is unknown or skipped that is when the host has
/// been told so.
Ok ok_of(const Command& command);

/// True for a line that takes the printer for a serial host: it may move, wait or change how later
/// lines are read. False for questions, and for what may be typed beside a job.
bool takes_the_printer(const Command& command);

}  // namespace qduino::printer::gcode
