#include "runtime/solver/figures.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace rapid {

StageSeconds& StageSeconds::operator+=(const StageSeconds& other)
{
    graph += other.graph;
    script += other.script;
    solve += other.solve;
    write += other.write;
    return *this;
}

ContactEnergy& ContactEnergy::operator+=(const ContactEnergy& other)
{
    added += other.added;
    lost += other.lost;
    return *this;
}

ErrorQuantiles ErrorQuantiles::of(std::vector<double> errors)
{
    // The smallest error that this percentage of the points does not exceed.
    const auto quantile = [&](std::size_t percentage) {
        const std::size_t points = (percentage * errors.size() + 99) / 100;
        const auto nth = errors.begin() + static_cast<std::ptrdiff_t>(points - 1);
        std::nth_element(errors.begin(), nth, errors.end());
        return *nth;
    };
    return {quantile(50), quantile(95), quantile(100)};
}

DriftSummary DriftSummary::of(const std::vector<double>& drifts)
{
    DriftSummary result;
    for (const double drift : drifts) {
        result.mean += drift / static_cast<double>(drifts.size());
        result.max = std::max(result.max, std::abs(drift));
    }
    return result;
}

// The ways to merge that the table names; `from` is the other part, or the later one.
namespace merge {
namespace {

template <class T>
void sum(T& into, const T& from)
{
    into += from;
}

template <class T>
void sum(std::vector<T>& into, const std::vector<T>& from)
{
    into.insert(into.end(), from.begin(), from.end());
}

void sum(std::optional<Ledger>& into, const std::optional<Ledger>& from)
{
    if (into && from)
        into->append(*from);
    else if (from)
        into = from;
}

template <class T>
void most(T& into, const T& from)
{
    into = std::max(into, from);
}

template <class T>
void last(T& into, const T& from)
{
    into = from;
}

template <class T>
void latest(std::optional<T>& into, const std::optional<T>& from)
{
    if (from) into = from;
}

// Keeps the bands of the later part, with the seconds of both, then those of other nodes.
void by_node(std::vector<BandFigures>& into, const std::vector<BandFigures>& from)
{
    const std::vector<BandFigures> before = std::exchange(into, from);
    for (const BandFigures& band : before) {
        const auto same =
            std::find_if(into.begin(), into.end(), [&](const BandFigures& other) { return other.node == band.node; });
        if (same == into.end())
            into.push_back(band);
        else
            same->seconds += band.seconds;
    }
}

}  // namespace
}  // namespace merge

#define RAPID_FIGURE(type, name, together, ...) merge::together(name, other.name);
void FrameFigures::add(const FrameFigures& other) { RAPID_FIGURES(RAPID_FIGURE) }
#undef RAPID_FIGURE

#define RAPID_FIGURE(type, name, together, afterwards, ...) merge::afterwards(name, later.name);
void FrameFigures::append(const FrameFigures& later) { RAPID_FIGURES(RAPID_FIGURE) }
#undef RAPID_FIGURE

}  // namespace rapid
