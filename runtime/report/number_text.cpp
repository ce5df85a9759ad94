#include "runtime/report/number_text.h"

#include <fmt/format.h>

#include <algorithm>

namespace rapid {

std::string with_separators(std::uint64_t count)
{
    std::string text = std::to_string(count);
    for (std::size_t i = text.size(); i > 3;) text.insert(i -= 3, 1, ',');
    return text;
}

std::string in_millions(double count)
{
    if (count < 1e5) return with_separators(static_cast<std::uint64_t>(count));
    return fmt::format("{:.{}f} million", count / 1e6, count < 1e7 ? 2 : 1);
}

std::string memory_text(std::uint64_t bytes)
{
    const double mebibytes = static_cast<double>(bytes) / (1 << 20);
    return mebibytes < 1024 ? fmt::format("{:.1f} MiB", mebibytes) : fmt::format("{:.2f} GiB", mebibytes / 1024);
}

std::string duration_text(double seconds)
{
    if (seconds < 1) return fmt::format("{:.3f} s", seconds);
    if (seconds < 60) return fmt::format("{:.1f} s", seconds);
    const auto whole = static_cast<std::uint64_t>(seconds + 0.5);
    if (whole < 3600) return fmt::format("{} min {:02} s", whole / 60, whole % 60);
    return fmt::format("{} h {:02} min", whole / 3600, whole / 60 % 60);
}

std::string length_text(double metres)
{
    const double least[] = {1, 1e-2, 1e-3};  // m
    const char* const units[] = {"m", "cm", "mm", "µm"};
    const double factors[] = {1, 1e2, 1e3, 1e6};
    const auto unit = std::find_if(std::begin(least), std::end(least), [&](double l) { return metres >= l; });
    const auto k = static_cast<std::size_t>(unit - std::begin(least));
    const double value = factors[k] * metres;
    return value >= 10 ? fmt::format("{:.0f} {}", value, units[k]) : fmt::format("{:.2g} {}", value, units[k]);
}

std::string table_text(const TextTable& rows, std::size_t left)
{
    std::vector<std::size_t> widths(rows.front().size());
    for (const auto& cells : rows)
        for (std::size_t c = 0; c < cells.size(); ++c) widths[c] = std::max(widths[c], cells[c].size());
    std::string text;
    for (const auto& cells : rows) {
        for (std::size_t c = 0; c < cells.size(); ++c)
            text +=
                c < left ? fmt::format("{:<{}}  ", cells[c], widths[c]) : fmt::format("{:>{}}  ", cells[c], widths[c]);
        text.erase(text.find_last_not_of(' ') + 1);
        text += '\n';
    }
    return text;
}

}  // namespace rapid
