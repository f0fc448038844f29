#include "qduino/library/library_index.h"

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>

#include "base/parts.h"
#include "base/whole_number.h"
#include "qduino/library/library_folder.h"
#include "terminal/did_you_mean.h"

namespace qduino::apps {
namespace {

using Json = nlohmann::json;

std::string in_small_letters(std::string_view text) {
    std::string out;
    for (const char c : text) out += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return out;
}

std::strong_ordering compare_parts(std::string_view a, std::string_view b) {
    while (!a.empty() || !b.empty()) {
        const std::string_view x = cut(a, '.'), y = cut(b, '.');
        const auto m = whole_number<std::uint64_t>(x.empty() ? "0" : x);
        const auto n = whole_number<std::uint64_t>(y.empty() ? "0" : y);
        const auto order = m && n ? *m <=> *n : x.compare(y) <=> 0;
        if (order != std::strong_ordering::equal) return order;
    }
    return std::strong_ordering::equal;
}

std::string text_at(const Json& entry, const char* key) {
    const auto found = entry.find(key);
    return found != entry.end() && found->is_string() ? without_controls(found->get<std::string>()) : "";
}

IndexedLibrary library_of(const Json& entry) {
    IndexedLibrary library{.name = text_at(entry, "name"),
                           .version = text_at(entry, "version"),
                           .sentence = text_at(entry, "sentence"),
                           .url = text_at(entry, "url"),
                           .size = 0,
                           .sha256 = in_small_letters(text_at(entry, "checksum")),
                           .depends = {}};
    constexpr std::string_view kKind = "sha-256:";
    library.sha256 = library.sha256.starts_with(kKind) ? library.sha256.substr(kKind.size()) : "";
    if (const auto size = entry.find("size"); size != entry.end() && size->is_number_unsigned())
        library.size = size->get<std::uint64_t>();
    const auto depends = entry.find("dependencies");
    if (depends == entry.end() || !depends->is_array()) return library;
    for (const Json& one : *depends) {
        if (one.is_object() && !text_at(one, "name").empty()) library.depends.push_back(text_at(one, "name"));
    }
    return library;
}

bool comes_before(const IndexedLibrary& a, const IndexedLibrary& b) {
    return a.name != b.name ? a.name < b.name : compare_versions(a.version, b.version) > 0;
}

}  // namespace

std::strong_ordering compare_versions(std::string_view a, std::string_view b) {
    const std::size_t a_dash = std::min(a.find('-'), a.size()), b_dash = std::min(b.find('-'), b.size());
    const auto order = compare_parts(a.substr(0, a_dash), b.substr(0, b_dash));
    if (order != std::strong_ordering::equal) return order;
    // A version with something behind a dash comes before the one without.
    const bool a_whole = a_dash == a.size(), b_whole = b_dash == b.size();
    if (a_whole || b_whole) return a_whole <=> b_whole;
    return compare_parts(a.substr(a_dash + 1), b.substr(b_dash + 1));
}

Result<LibraryIndex> LibraryIndex::read(std::string_view json) {
    const Json read = Json::parse(json, nullptr, false);
    if (!read.is_object() || !read.contains("libraries") || !read["libraries"].is_array())
        return make_error(ErrorCode::corrupt, "the index of libraries is not what it should be");
    LibraryIndex index;
    for (const Json& entry : read["libraries"]) {
        if (!entry.is_object()) continue;
        IndexedLibrary library = library_of(entry);
        if (!library.name.empty() && !library.version.empty() && !library.url.empty())
            index.libraries_.push_back(std::move(library));
    }
    std::ranges::stable_sort(index.libraries_, comes_before);
    return index;
}

const IndexedLibrary* LibraryIndex::find(std::string_view name, std::string_view version) const {
    const auto is_it = [&](const IndexedLibrary& library) {
        return library.name == name &&
               (version.empty() || compare_versions(library.version, version) == std::strong_ordering::equal);
    };
    const auto found = std::ranges::find_if(libraries_, is_it);
    return found == libraries_.end() ? nullptr : &*found;
}

std::vector<const IndexedLibrary*> LibraryIndex::search(const std::vector<std::string>& words) const {
    std::vector<const IndexedLibrary*> found;
    for (const IndexedLibrary& library : libraries_) {
        if (!found.empty() && found.back()->name == library.name) continue;
        const std::string text = in_small_letters(library.name + ' ' + library.sentence);
        const auto has = [&](const std::string& word) {
            return text.find(in_small_letters(word)) != std::string::npos;
        };
        if (std::ranges::all_of(words, has)) found.push_back(&library);
    }
    return found;
}

std::string LibraryIndex::nearest_name(const std::string& name) const {
    std::vector<std::string> names;
    for (const IndexedLibrary& library : libraries_) {
        if (in_small_letters(library.name) == in_small_letters(name)) return library.name;
        if (names.empty() || names.back() != library.name) names.push_back(library.name);
    }
    return nearest(name, names);
}

}  // namespace qduino::apps
