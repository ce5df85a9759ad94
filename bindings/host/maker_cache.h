// What a function of the frame made when it was called last: an equal call of a constructor is answered with that
// object, so that what stays the same is not built again, and all that is kept by its identity stays valid.
//
// Of two calls only: a function that returns another shape at each frame holds two of them, not one a frame.
#pragma once

#include <memory>
#include <vector>

#include "bindings/host/maker.h"

namespace rapid {

class MadeBefore {
public:
    // Forgets all that the last call did not make.
    void begin_call();

    // The object that was made before of equal arguments, else what make() makes.
    template <class F>
    ObjectPtr get(const Maker& maker, std::shared_ptr<const Table> arguments, const F& make)
    {
        ObjectPtr object = find(maker, *arguments);
        if (!object) object = make();
        made_.push_back({&maker, std::move(arguments), object});
        return object;
    }

private:
    struct Entry {
        const Maker* maker;
        std::shared_ptr<const Table> arguments;
        ObjectPtr object;
    };
    ObjectPtr find(const Maker& maker, const Table& arguments) const;

    std::vector<Entry> last_, made_;  // in the call before, and in this one
};

// Whether two values can't be told apart: numbers by their bits, objects by identity. Functions never are.
bool identical(const Value& a, const Value& b);

}  // namespace rapid
