// The objects that a function of the frame made in its last call: a constructor that is called again with the same
// arguments returns the same object, so that nothing is built twice, and caches by identity stay valid.
//
// It holds the objects of two calls: a function that returns another shape at each frame keeps two shapes, not one a
// frame.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "bindings/host/maker.h"

namespace rapid {

class MakerCache {
public:
    // The cached object of equal arguments, else the object that make() returns.
    template <class F>
    ObjectPtr get(const Maker& maker, std::shared_ptr<const Table> arguments, const F& make)
    {
        ObjectPtr object = find(maker, *arguments);
        if (!object) object = make();
        current_.push_back({&maker, std::move(arguments), object});
        return object;
    }

    // Forgets all objects that the last call did not make.
    void begin_call();

    // A call of the function: for as long as it lives, `active` points to its cache.
    class Call {
    public:
        Call(MakerCache& cache, MakerCache*& active) : active_(active), before_(std::exchange(active, &cache))
        {
            cache.begin_call();
        }
        ~Call() { active_ = before_; }
        Call(const Call&) = delete;
        Call& operator=(const Call&) = delete;

    private:
        MakerCache*& active_;
        MakerCache* before_;
    };

private:
    struct Entry {
        const Maker* maker;
        std::shared_ptr<const Table> arguments;
        ObjectPtr object;
    };
    ObjectPtr find(const Maker& maker, const Table& arguments) const;

    std::vector<Entry> last_, current_;  // of the call before, and of this one
};

// Whether two values can't be told apart: numbers by their bits, objects by identity. Functions always can.
bool identical(const Value& a, const Value& b);

}  // namespace rapid
