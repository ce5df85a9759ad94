// Serializes the figures of a frame: those of the table, and the types that they consist of. A new member of such a
// type does not compile until it is named here.
#pragma once

#include "bindings/run/frame_record.h"
#include "runtime/points/state_archive.h"

namespace rapid {

template <StateArchive Archive>
void serialize(Archive& keep, Stiffness::Improvement& improvement)
{
    auto& [error, substeps, error_after] = improvement;
    keep(error, substeps, error_after);
}

template <StateArchive Archive>
void serialize(Archive& keep, Stiffness& stiffness)
{
    auto& [node, kind, step, substeps, frame, improvement, alone] = stiffness;
    int number = kind;
    keep(node, number, step, substeps, frame, improvement, alone);
    if constexpr (Archive::is_loading::value) StateReader::expect(0 <= number && number <= Stiffness::Oscillation);
    kind = static_cast<Stiffness::Kind>(number);
}

template <StateArchive Archive>
void serialize(Archive& keep, ErrorQuantiles& error)
{
    auto& [p50, p95, max] = error;
    keep(p50, p95, max);
}

template <StateArchive Archive>
void serialize(Archive& keep, DriftSummary& drift)
{
    auto& [mean, max] = drift;
    keep(mean, max);
}

template <StateArchive Archive, class Summary>
void serialize(Archive& keep, Sampled<Summary>& figure)
{
    keep(figure.summary);
}

template <StateArchive Archive>
void serialize(Archive& keep, ContactEnergy& energy)
{
    auto& [added, lost] = energy;
    keep(added, lost);
}

// Replaces cereal's version, which clang rejects for a nested class: it believes that this has no default constructor.
template <StateArchive Archive, class T>
void keep_optional(Archive& keep, std::optional<T>& value)
{
    bool is_there = value.has_value();
    T held = is_there ? std::move(*value) : T();
    keep(is_there, held);
    value.reset();
    if (is_there) value = std::move(held);
}

template <StateArchive Archive>
void serialize(Archive& keep, EnergyChanges::Split& split)
{
    auto& [friction, shapes] = split;
    keep(friction, shapes);
}

template <StateArchive Archive>
void serialize(Archive& keep, EnergyChanges& changes)
{
    auto& [rods, contacts, pins, drag, split] = changes;
    keep(rods, contacts, pins, drag);
    keep_optional(keep, split);
}

template <StateArchive Archive>
void serialize(Archive& keep, Ledger::Residue& residue)
{
    auto& [energy, momentum, angular_momentum] = residue;
    keep(energy, momentum, angular_momentum);
}

template <StateArchive Archive>
void serialize(Archive& keep, Ledger& ledger)
{
    auto& [kinetic, potential, elastic, by, by_motion, momentum, angular_momentum, residue] = ledger;
    keep(kinetic, potential, elastic, by, by_motion, momentum, angular_momentum);
    keep_optional(keep, residue);
}

template <StateArchive Archive>
void serialize(Archive& keep, BandFigures& band)
{
    auto& [node, width, voxels, seconds] = band;
    keep(node, width, voxels, seconds);
}

template <StateArchive Archive>
void serialize(Archive& keep, ContactGrids& grids)
{
    auto& [points, error, excess, search_seconds] = grids;
    keep(points, error, excess, search_seconds);
}

template <StateArchive Archive>
void serialize(Archive& keep, StageSeconds& all)
{
    auto& [graph, script, solve, write] = all;
    keep(graph, script, solve, write);
}

template <StateArchive Archive>
void serialize(Archive& keep, NodeWork& work)
{
    auto& [nodes, stage, begin, seconds, points, bytes] = work;
    keep(nodes, seconds, points, bytes);  // stage and begin are only for the profile
}

template <StateArchive Archive>
void serialize(Archive& keep, FrameFigures& figures)
{
#define RAPID_FIGURE(type, name, ...) keep(figures.name);
    RAPID_FIGURES(RAPID_FIGURE)
#undef RAPID_FIGURE
}

}  // namespace rapid
