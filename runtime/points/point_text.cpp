#include "runtime/points/point_text.h"

#include <fmt/format.h>

#include "runtime/base/printable.h"
#include "runtime/points/point_names.h"

namespace rapid {
namespace {

std::string text_of(const Vec3f& x) { return fmt::format("{{{:g}, {:g}, {:g}}}", x.x(), x.y(), x.z()); }
std::string text_of(const Quatf& q) { return fmt::format("{{{:g}, {:g}, {:g}, {:g}}}", q.x(), q.y(), q.z(), q.w()); }
std::string text_of(Token x) { return fmt::format("\"{}\"", printable(x.text())); }
std::string text_of(float x) { return fmt::format("{:g}", x); }
template <class Whole>
std::string text_of(Whole x)
{
    return std::to_string(x);
}

}  // namespace

std::string text_of_point(const PointSet& points, std::size_t i)
{
    std::string text = fmt::format("P = {}, v = {}", text_of(points.P()[i]), text_of(points.v()[i]));
    for (const auto& [name, column] : points.columns())
        if (!is_own_column(name))
            text += fmt::format(", {} = {}", name, std::visit([&](const auto& c) { return text_of(c[i]); }, column));
    for (const auto& [name, members] : points.groups())
        if (members[i]) text += fmt::format(", in \"{}\"", name);
    return text;
}

}  // namespace rapid
