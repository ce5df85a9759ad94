// Makers of graph code's objects (meshes, level sets, shapes, points, motions). Each is declared once, with parameters
// that are checked and documented like those of nodes.
//
//   struct MeshSphere {
//       double radius; int divisions; Vec3d center;
//       static Maker declare() { return maker<MeshSphere>("mesh.sphere", "A sphere.").param(...); }
//       ObjectPtr make(MakeContext& context) const;
//   };
//   RAPID_MAKER(MeshSphere);
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "runtime/graph/param.h"

namespace rapid {

struct MakeContext {
    std::filesystem::path folder;  // folder of the graph file, to which paths are relative
    std::vector<std::string>& warnings;
    bool may_write;  // false in check, explain and test, which write nothing
    std::function<void(const std::filesystem::path& file)> on_read;  // may be empty
    std::function<std::string(const std::string& path)> find_file;   // may be empty, and return nothing

    // Returns the path of a file that will be read, with escapes (FramePattern) resolved.
    std::filesystem::path resolve(const std::string& path) const;
};

struct Maker {
    std::string name, doc;
    std::vector<Param> params;
    std::function<ObjectPtr(const Maker& self, const Table& arguments, MakeContext& context)> make;
};

template <class T>
class MakerDeclaration {
public:
    MakerDeclaration(std::string name, std::string doc)
    {
        maker_.name = std::move(name);
        maker_.doc = std::move(doc);
        maker_.make = [](const Maker& self, const Table& arguments, MakeContext& context) -> ObjectPtr {
            T fields{};
            assign_arguments(self.params, arguments.named, &fields);
            return fields.make(context);
        };
    }

    template <class F>
    MakerDeclaration& param(F T::*field, std::string name, Value fallback, Range range, std::string unit,
                            std::string doc)
    {
        maker_.params.push_back(
            param_of(field, std::move(name), std::move(fallback), range, std::move(unit), std::move(doc)));
        return *this;
    }
    MakerDeclaration& required() { return maker_.params.back().required = true, *this; }
    MakerDeclaration& choices(std::vector<std::string> names)
    {
        return maker_.params.back().choices = std::move(names), *this;
    }
    // Marks a parameter that Rapid's own Lua files set, not users.
    MakerDeclaration& internal() { return maker_.params.back().internal = true, *this; }

    operator Maker() const { return maker_; }

private:
    Maker maker_;
};

template <class T>
MakerDeclaration<T> maker(std::string name, std::string doc)
{
    return MakerDeclaration<T>(std::move(name), std::move(doc));
}

// Returns a maker. Throws if there is none, which is a bug in Rapid's own Lua files.
const Maker& find_maker(std::string_view name);

// Returns all makers, ordered by name.
std::vector<const Maker*> all_makers();

// Evaluated when a maker is first needed, after all registrations of the program.
struct MakerRegistration {
    explicit MakerRegistration(std::vector<Maker> (*declare)());
};
#define RAPID_MAKER(Type)                                 \
    static const ::rapid::MakerRegistration maker_##Type( \
        []() -> std::vector<::rapid::Maker> { return {Type::declare()}; })
// Registers a function that returns several makers.
#define RAPID_MAKERS(function) static const ::rapid::MakerRegistration makers_of_##function(function)

// Caches the objects that a function of the frame made in its last call. A constructor called again with the same
// arguments returns the same object, so that nothing is built twice, and caches by identity stay valid.
//
// It holds the objects of two calls: a function that returns a new shape at each frame retains two shapes, not one per
// frame.
class MakerCache {
public:
    // Returns the cached object for equal arguments, or the object that make() returns.
    template <class F>
    ObjectPtr get(const Maker& maker, std::shared_ptr<const Table> arguments, const F& make)
    {
        ObjectPtr object = find(maker, *arguments);
        if (!object) object = make();
        current_.push_back({&maker, std::move(arguments), object});
        return object;
    }

    // Forgets all objects that the last call did not use.
    void begin_call();

    // A call of the function. While it lives, `active` points to its cache.
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

    std::vector<Entry> last_, current_;  // objects of the previous call and of this one
};

// Returns true if two values are indistinguishable: numbers bitwise, objects by identity. Functions are never
// identical.
bool identical(const Value& a, const Value& b);

}  // namespace rapid
