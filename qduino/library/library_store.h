// Puts a library into a folder of libraries, and takes one out. What comes in is looked at beside
// the others before it has a name there:
//
//   a folder, a zip, a git repository ──► .qduino-Xy12/new ──► is it a library? ──► NAME
//                                                      no: the folder is as it was
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "base/result.h"
#include "qduino/library/library_folder.h"

namespace qduino::apps {

/// The programs that fetch and unpack.
struct LibraryTools {
    std::string python;
    std::filesystem::path unpack_zip;  ///< tools/library/unpack_zip.py
};

/// What a downloaded archive must be.
struct ArchiveFacts {
    std::uint64_t size = 0;  ///< bytes; 0: not known
    std::string sha256;      ///< empty: not known
};

class LibraryStore {
  public:
    LibraryStore(std::filesystem::path folder, LibraryTools tools)
        : folder_(std::move(folder)), tools_(std::move(tools)) {}

    /// Each puts a library in, under its own name, and returns it. Error: invalid_argument (it is
    /// no library, or holds links), already_exists, corrupt (not the archive that was promised), or
    /// what the programs say; then nothing is changed.
    [[nodiscard]] Result<Library> add_folder(const std::filesystem::path& folder) const;
    [[nodiscard]] Result<Library> add_zip(const std::filesystem::path& archive) const;
    /// `url` may end in "#BRANCH" or "#TAG".
    [[nodiscard]] Result<Library> add_git(const std::string& url) const;
    [[nodiscard]] Result<Library> add_download(const std::string& url, const ArchiveFacts& facts) const;

    /// Removes the library of this name, or in the folder of this name, whole. Error: not_found.
    [[nodiscard]] Result<Library> remove(const std::string& name) const;
    /// The library of this name, or in the folder of this name.
    [[nodiscard]] std::optional<Library> find(const std::string& name) const;

  private:
    class Staging;
    [[nodiscard]] Result<Library> accept(const Staging& staging, const std::string& fallback_name) const;
    [[nodiscard]] Result<void> unpack(const std::filesystem::path& archive, const Staging& staging) const;

    std::filesystem::path folder_;
    LibraryTools tools_;
};

/// Fetches `url` (https, http or file) into `file`, at most `bytes_max`. Error: unavailable, with
/// curl's own words.
[[nodiscard]] Result<void> download(const std::string& url, const std::filesystem::path& file,
                                    std::uint64_t bytes_max);

/// The folder for a library of this name: letters, digits, _ - and . stay; never hidden, never
/// elsewhere.
[[nodiscard]] std::string library_folder_name(const std::string& name);

}  // namespace qduino::apps
