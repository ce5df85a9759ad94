// A scene whose points touch each other.
#pragma once

#include <memory>

#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/constraints/contacts.h"
#include "runtime/solver/constraints/shape_contacts.h"
#include "tests/solver/scene.h"

namespace rapid::test {

class Spheres : public Constraint {
public:
    ContactOptions options;
    std::shared_ptr<Contacts> contacts = std::make_shared<Contacts>();

    std::shared_ptr<Coupling> begin(const PointSet& set, double) const override
    {
        contacts->follow(set, options, group);
        return contacts;
    }
    std::shared_ptr<const Constraint> twin(const Constraint* before) const override
    {
        return twin_of(*this, &Spheres::contacts, before);
    }
};

inline std::vector<float> alike(std::size_t n, float value) { return std::vector<float>(n, value); }

class Granular : public Scene {
public:
    ShapeLoads loads;
    std::shared_ptr<Spheres> spheres = std::make_shared<Spheres>();

    explicit Granular(PointSet set, float bounce = 0, float friction = 0) : Scene(std::move(set))
    {
        options.loads = &loads;
        spheres->node = "contact1";
        spheres->options.bounce = bounce;
        spheres->options.friction = friction;
        dynamics.add(spheres);
    }

    Vec3d momentum() const
    {
        Vec3d sum = Vec3d::Zero();
        const auto* mass = points.find<float>("mass");
        for (std::size_t i = 0; i < points.size(); ++i) sum += (mass ? (*mass)[i] : 1.0) * v(i);
        return sum;
    }
    double deepest() const  // overlap of two points, m
    {
        const auto& r = points.column<float>("pscale");
        double worst = 0;
        for (std::size_t i = 0; i < points.size(); ++i)
            for (std::size_t j = 0; j < i; ++j)
                worst = std::max(worst, double(r[i]) + double(r[j]) - (P(i) - P(j)).norm());
        return worst;
    }
};

}  // namespace rapid::test
