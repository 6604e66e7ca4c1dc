#include <algorithm>
#include <cstddef>
#include <cstring>
#include <filesystem>
#include <string>

// The names in a folder, each followed by a null character; returns how many characters that takes, at most `capacity` of
// which are written.
extern "C" std::size_t nocdyn_folder_names(const char *path, char *names, std::size_t capacity)
{
    std::error_code failure;
    std::string found;
    for (std::filesystem::directory_iterator entry(path, failure), end; !failure && entry != end; entry.increment(failure))
        found += entry->path().filename().string() + '\0';
    std::memcpy(names, found.data(), std::min(capacity, found.size()));
    return found.size();
}
