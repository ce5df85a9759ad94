// Serialization of contacts (points/state_archive.h): pairs with their impulses, loads on shapes, and sleep records.
#pragma once

#include "runtime/points/state_archive.h"
#include "runtime/solver/constraints/contact_material.h"
#include "runtime/solver/constraints/contact_search.h"
#include "runtime/solver/constraints/pair_impulses.h"
#include "runtime/solver/constraints/shape_contacts.h"
#include "runtime/solver/constraints/sleep.h"

namespace rapid {

template <StateArchive Archive>
void serialize(Archive& keep, ContactMaterial& material)
{
    keep(material.radius, material.root_friction, material.restitution, material.bounces, material.rolling);
}

template <StateArchive Archive>
void serialize(Archive& keep, RadiusGrids::Grid& grid)
{
    keep(grid.radius, grid.points);
}
template <StateArchive Archive>
void serialize(Archive& keep, RadiusGrids& grids)
{
    keep(grids.grids, grids.of, grids.error, grids.excess);
}

template <StateArchive Archive>
void serialize(Archive& keep, Pairs& pairs)
{
    keep(pairs.begin, pairs.other);
}
template <StateArchive Archive>
void serialize(Archive& keep, PairImpulses& impulses)
{
    keep(impulses.pairs, impulses.normal, impulses.tangential, impulses.resting, impulses.rolling);
}

template <StateArchive Archive>
void serialize(Archive& keep, ShapeLoads::Load& load)
{
    keep(load.id, load.obstacle, load.normal, load.tangent, load.rolling);
}
template <StateArchive Archive>
void serialize(Archive& keep, ShapeLoads& loads)
{
    keep(loads.loads);
}

template <StateArchive Archive>
void serialize(Archive& keep, ShapeGrip& grip)
{
    keep(grip.hash, grip.normal);
}
template <StateArchive Archive>
void serialize(Archive& keep, SleepRecords::Record& record)
{
    keep(record.id, record.P, record.inverse_mass, record.acceleration, record.grip, record.load);
}
template <StateArchive Archive>
void serialize(Archive& keep, SleepRecords& records)
{
    keep(records.records);
}

}  // namespace rapid
