#include "bindings/run/run_journal.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string_view>

#include "bindings/run/frame_record_archive.h"
#include "runtime/files/content_hash.h"
#include "runtime/files/input_file.h"
#include "runtime/files/output_file.h"

namespace rapid {
namespace {

constexpr std::string_view magic = "\x89RAPIDJ\n";

enum class EntryKind : std::uint8_t { Head, Frame, Film };

template <class T>
SavedState entry_of(EntryKind kind, const T& value)
{
    StateWriter writer;
    writer(static_cast<std::uint8_t>(kind), value);
    return writer.take();
}

std::string framed(const SavedState& entry)
{
    const std::uint64_t ends[] = {entry.bytes.size(), content_hash({entry.bytes.data(), entry.bytes.size()})};
    std::string text(sizeof ends, '\0');
    std::memcpy(text.data(), ends, sizeof ends);
    return text.append(entry.bytes.data(), entry.bytes.size());
}

// The entries that are whole.
std::vector<SavedState> entries_of(std::string_view text, std::size_t& damaged)
{
    std::vector<SavedState> entries;
    while (!text.empty()) {
        std::uint64_t ends[2];
        if (text.size() < sizeof ends) break;
        std::memcpy(ends, text.data(), sizeof ends);
        text.remove_prefix(sizeof ends);
        if (ends[0] > text.size()) break;
        const std::string_view entry = text.substr(0, static_cast<std::size_t>(ends[0]));
        text.remove_prefix(entry.size());
        entries.emplace_back();
        if (content_hash(entry) == ends[1])
            entries.back().bytes.assign(entry.begin(), entry.end());
        else
            ++damaged;
    }
    if (!text.empty()) ++damaged;
    return entries;
}

}  // namespace

RunJournal::Contents RunJournal::read(const std::filesystem::path& file,
                                      const std::function<bool(const Fingerprint&)>& is_of_run, bool& is_there)
{
    Contents contents;
    is_there = std::filesystem::exists(file);
    if (!is_there) return contents;
    const InputFile input(file);
    if (input.text().substr(0, magic.size()) != magic) {
        contents.damaged = 1;
        return contents;
    }
    std::vector<SavedState> entries = entries_of(input.text().substr(magic.size()), contents.damaged);
    for (const SavedState& entry : entries) {
        if (entry.bytes.empty()) continue;  // damaged
        try {
            StateReader reader(entry);
            std::uint8_t number = 0;
            reader(number);
            const EntryKind kind{number};
            if ((kind == EntryKind::Head) != (&entry == &entries.front())) StateReader::fail();
            if (kind == EntryKind::Head) {
                reader(contents.fingerprint);
                if (!is_of_run(contents.fingerprint)) return contents;
            } else if (contents.fingerprint.empty()) {
                return contents;
            } else if (kind == EntryKind::Frame) {
                FrameRecord record;
                reader(record);
                for (const auto& [name, hash_then] : record.read) StateReader::expect(InputContents::is_content(name));
                contents.frames[record.statistics.frame] = std::move(record);
            } else {
                WrittenFile film;
                reader(film);
                contents.films[film.path] = film;
            }
            reader.finish();
        } catch (const Error&) {
            ++contents.damaged;
        }
    }
    return contents;
}

void RunJournal::begin(const std::filesystem::path& file, const Contents& contents)
{
    OutputFile output(file);
    output.append(magic.data(), magic.size());
    const auto append = [&](const SavedState& entry) {
        const std::string text = framed(entry);
        output.append(text.data(), text.size());
    };
    append(entry_of(EntryKind::Head, contents.fingerprint));
    for (const auto& [frame, record] : contents.frames) append(entry_of(EntryKind::Frame, record));
    for (const auto& [path, film] : contents.films) append(entry_of(EntryKind::Film, film));
    output.finish();
    file_ = Descriptor(::open(file.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC));
    if (!file_) throw file_error("can't be written", errno);
}

void RunJournal::add(const FrameRecord& record) { add(entry_of(EntryKind::Frame, record)); }
void RunJournal::add(const WrittenFile& film) { add(entry_of(EntryKind::Film, film)); }

void RunJournal::add(const SavedState& entry)
{
    if (!file_) return;  // it could not be begun
    const std::string text = framed(entry);
    const off_t end = ::lseek(file_.number(), 0, SEEK_END);
    for (std::size_t done = 0; done < text.size();) {
        const ssize_t count = ::write(file_.number(), text.data() + done, text.size() - done);
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) {
            const int reason = count < 0 ? errno : ENOSPC;
            // A part of an entry would hide those behind it.
            if (::ftruncate(file_.number(), end) != 0) file_ = Descriptor();
            throw file_error("can't be written", reason);
        }
        done += static_cast<std::size_t>(count);
    }
}

}  // namespace rapid
