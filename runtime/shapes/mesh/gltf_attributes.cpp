#include "runtime/shapes/mesh/gltf_attributes.h"

#include <fmt/format.h>

#include <optional>
#include <span>

#include "runtime/base/checked_json.h"
#include "runtime/base/error.h"
#include "runtime/files/base64.h"
#include "runtime/files/input_file.h"
#include "runtime/files/scalars.h"
#include "runtime/files/skipped_contents.h"

namespace rapid {
namespace {

using json = SortedCheckedJson;
using Bytes = std::vector<unsigned char>;

constexpr std::uint32_t binary_mark = 0x46546c67;  // "glTF"
constexpr std::uint32_t json_chunk = 0x4e4f534a, binary_chunk = 0x004e4942;

struct Component {
    int number;
    ScalarType type;
    double largest;  // the largest value, if normalized
};
constexpr Component components[] = {
    {5120, ScalarType::Int8, 127},     {5121, ScalarType::UInt8, 255},  {5122, ScalarType::Int16, 32767},
    {5123, ScalarType::UInt16, 65535}, {5125, ScalarType::UInt32, 1.0}, {5126, ScalarType::Float, 1.0},
};

std::string_view text_of(std::span<const unsigned char> bytes)
{
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

class GltfFile {
public:
    explicit GltfFile(const std::filesystem::path& path) : folder_(path.parent_path())
    {
        const InputFile file(path);
        std::span<const unsigned char> text = file.bytes();
        if (text.size() >= 4 && load_scalar<std::uint32_t>(text.data(), ByteOrder::Little) == binary_mark)
            text = take_chunks(text);
        document_ = json::parse(text_of(text));
    }

    GltfAttributes attributes()
    {
        GltfAttributes all;
        const auto meshes = document_.find("meshes");
        if (meshes == document_.end()) return all;
        for (const json& mesh : *meshes)  // by reference: copying deeply nested lists would overflow the stack
            for (const json& primitive : mesh.at("primitives")) {
                GltfAttributes::Primitive& one = all.primitives.emplace_back();
                const json& named = primitive.at("attributes");
                if (named.contains("POSITION")) one.vertices = accessor(named.at("POSITION")).at("count");
                for (const auto& [name, number] : named.items()) {
                    if (!name.starts_with('_')) continue;
                    std::optional<Mesh::VertexValues> values = values_of(accessor(number), one.vertices);
                    if (values)
                        one.values.emplace(name.substr(1), std::move(*values));
                    else
                        add_skipped(all.skipped, fmt::format("the attribute \"{}\"", name));
                }
            }
        return all;
    }

private:
    // Returns the JSON text of a binary file and sets the first buffer.
    std::span<const unsigned char> take_chunks(std::span<const unsigned char> file)
    {
        constexpr std::size_t header = 12, head = 8;
        std::span<const unsigned char> text;
        for (std::size_t at = header; at + head <= file.size();) {
            const auto size = load_scalar<std::uint32_t>(file.data() + at, ByteOrder::Little);
            const auto type = load_scalar<std::uint32_t>(file.data() + at + 4, ByteOrder::Little);
            if (size > file.size() - at - head) throw Error("the file ends within a chunk");
            const auto chunk = file.subspan(at + head, size);
            if (type == json_chunk) text = chunk;
            if (type == binary_chunk) buffers_[0] = Bytes(chunk.begin(), chunk.end());
            at += head + size;
        }
        return text;
    }

    const json& accessor(const json& number) const { return document_.at("accessors").at(number.get<std::size_t>()); }

    const Bytes& buffer(std::size_t number)
    {
        const auto [found, is_new] = buffers_.try_emplace(number);
        if (!is_new) return found->second;
        constexpr std::string_view data = "data:", encoding = ";base64,";
        const auto uri = document_.at("buffers").at(number).at("uri").get<std::string>();
        if (uri.starts_with(data)) {
            const std::size_t begin = uri.find(encoding);
            if (begin == std::string::npos) throw Error(fmt::format("buffer {} is not valid base64", number));
            found->second = from_base64(std::string_view(uri).substr(begin + encoding.size()));
        } else {
            const InputFile file(folder_ / uri);
            found->second.assign(file.bytes().begin(), file.bytes().end());
        }
        return found->second;
    }

    // Returns the values, or nothing unless they are numbers or vectors of three, one per vertex, contiguous in a
    // buffer.
    std::optional<Mesh::VertexValues> values_of(const json& accessor, std::size_t vertices)
    {
        const auto type = accessor.at("type").get<std::string>();
        const auto component = std::find_if(std::begin(components), std::end(components), [&](const Component& c) {
            return c.number == accessor.at("componentType").get<int>();
        });
        const bool is_vector = type == "VEC3";
        if ((!is_vector && type != "SCALAR") || component == std::end(components) || accessor.contains("sparse") ||
            !accessor.contains("bufferView") || accessor.at("count").get<std::size_t>() != vertices)
            return {};
        const json& view = document_.at("bufferViews").at(accessor.at("bufferView").get<std::size_t>());
        const Bytes& bytes = buffer(view.at("buffer").get<std::size_t>());
        const std::size_t numbers = is_vector ? 3 : 1, value = numbers * scalar_bytes(component->type);
        const std::size_t stride = view.value("byteStride", value);
        const std::size_t first = view.value("byteOffset", std::size_t{0}),
                          inner = accessor.value("byteOffset", std::size_t{0});
        if (first > bytes.size() || inner > bytes.size() - first || stride > bytes.size() ||
            (vertices > 0 &&
             (bytes.size() - first - inner < value ||
              (vertices - 1) > (bytes.size() - first - inner - value) / std::max<std::size_t>(stride, 1))))
            throw Error(fmt::format("an accessor of {} values goes beyond its buffer", vertices));
        const double scale = accessor.value("normalized", false) ? 1 / component->largest : 1;
        const auto number = [&](std::size_t i, std::size_t c) {
            const unsigned char* at = bytes.data() + first + inner + i * stride + c * scalar_bytes(component->type);
            return with_scalar(component->type, [&](auto like) {
                const auto x = static_cast<double>(load_scalar<decltype(like)>(at, ByteOrder::Little)) * scale;
                return static_cast<float>(scale == 1 ? x : std::max(x, -1.0));
            });
        };
        if (!is_vector) {
            std::vector<float> list(vertices);
            for (std::size_t i = 0; i < vertices; ++i) list[i] = number(i, 0);
            return list;
        }
        std::vector<Vec3f> list(vertices);
        for (std::size_t i = 0; i < vertices; ++i) list[i] = Vec3f(number(i, 0), number(i, 1), number(i, 2));
        return list;
    }

    const std::filesystem::path folder_;
    json document_;
    std::map<std::size_t, Bytes> buffers_;
};

}  // namespace

GltfAttributes read_gltf_attributes(const std::filesystem::path& path)
{
    try {
        return GltfFile(path).attributes();
    } catch (const json::exception& error) {
        throw Error(fmt::format("its JSON is damaged: {}", error.what()));
    }
}

}  // namespace rapid
