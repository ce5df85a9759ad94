// Scenes whose nodes keep state between frames, by subject. They are small, and together cover nearly all node types;
// test_snapshots.cpp tries the remaining types with their defaults.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace rapid::test {

inline const std::vector<std::pair<std::string, std::string>> scenes_with_state = {
    {"rates that change, births that are owed", R"(
        return rapid.create { fps = 24, seed = 3 }
          :emit { source = rapid.mesh.sphere { radius = 0.2 }, birth = "even", life = {0.2, 0.5},
                  rate = function(frame) return 37.3 + 5.1 * frame.number end, velocity = {0, 3, 0}, spread = 20 }
          :emit { source = rapid.shape.sphere { radius = 0.1 }, impulse = { [1] = 20, [7] = 11 }, attributes = { heat = {0, 1} } }
          :gravity {} :drag { linear = 0.3, quadratic = 0.1 } :wind { velocity = {1, 0, 0}, drag = 0.2 }
          :turbulence { amplitude = 2 } :vortex { strength = 1 } :attract { center = {0, 1, 0}, strength = 0.5 }
          :delete { where = function(p) return p.P.y < -0.4 end }
          :attribute { pscale = 0.01 } :trail { places = 3 } :picture { shutter = 0.5 }
          :solve { substeps = 2 })"},
    {"trails that no solve feeds back, of points that are born and die", R"(
        local born = rapid.create { seed = 3 }
          :emit { source = rapid.mesh.sphere {}, rate = 150, life = {0.2, 0.4}, velocity = {1, 2, 0} }
          :gravity {} :solve {}
        return { main = born:trail { places = 4 },
                 merged = born:merge(rapid.create { seed = 4 }
                   :emit { source = rapid.mesh.sphere {}, rate = 50, life = 0.3 } :solve {}):trail { places = 2 } })"},
    {"places that points have taken, and texts", R"(
        return rapid.create { fps = 24, seed = 3 }
          :emit { source = rapid.mesh.sphere {}, rate = 150, life = {0.2, 0.4}, attributes = { name = {"a", "b"} } }
          :points("grow", function(p, frame) if p:rand(1, frame) < 0.2 then p.name = p.name .. frame.number end end)
          :goal { to = rapid.points.grid { size = {1, 1, 1}, spacing = 0.25 }, by = "nearest", time = 0.5, stagger = 0.2,
                  clock = "age" }
          :goal { to = rapid.mesh.box {}:transform(function(frame) return rapid.rotate({0, 1, 0}, frame.number ^ 2) end),
                  by = "random", group = "few" }
          :group { name = "few", where = function(p) return p.name:sub(1, 1) == "b" end }
          :solve {})"},
    {"sources that move, and sets of points that are another at each frame", R"(
        local moving = function(frame)
          local places = {}
          for k = 1, 5 do places[k] = { k + 0.1 * frame.number ^ 2, 0.2 * k * math.sin(frame.number), 0 } end
          return rapid.points.from { P = places }
        end
        return rapid.create { fps = 24, seed = 3 }
          :emit { source = moving, rate = 100.7, inherit_velocity = 1, life = 0.6 }
          :emit { source = rapid.mesh.sphere { radius = 0.2 }:transform(function(frame)
                    return rapid.translate(0.1 * frame.number ^ 2, 0, 0) end), rate = 60, life = 0.4 }
          :gravity {} :solve {})"},
    {"parents: of a rate, by hits, deaths and comparisons, of their own chain", R"(
        local balls = rapid.create { fps = 24, seed = 5, subframes = 2 }
          :emit { source = rapid.mesh.grid { size = {1, 1}, center = {0, 0.3, 0} }, rate = 40, velocity = {0, -2, 0},
                  life = {0.3, 0.6} }
          :gravity {} :collide { shape = rapid.shape.plane {}, bounce = 0.7 } :solve {}
        local smoke = rapid.create { fps = 24, seed = 5, subframes = 2 }
          :spawn { from = balls, rate = 33.3, life = 0.3 }
          :spawn { from = balls, on = "hit", count = 2, life = 0.5 }
          :spawn { from = balls, on = "death", count = 3, limit = 2, split = true, life = 0.5 }
          :spawn { from = balls, on = "age > 0.2", count = 1, life = 0.5 }
          :spawn { from = balls, on = function(p) return p.P.y < 0.1 end, count = 1, life = 0.5 }
          :solve {}
        local own = rapid.create { fps = 24, seed = 6, subframes = 2 }
          :emit { source = rapid.shape.sphere { radius = 0.1 }, rate = 30, life = 0.5, velocity = {1, 0, 0} }
        own = own:spawn { from = own, rate = 20, birth = "even", life = 0.1 } :solve {}
        return smoke:merge(balls, own))"},
    {"points that another chain adopts", R"(
        local a = rapid.create { seed = 1 }
          :emit { source = rapid.mesh.grid {}, rate = 50, life = 0.3 } :gravity {}
        local b = rapid.create { seed = 2 }
          :emit { source = rapid.mesh.sphere {}, rate = 70, life = 0.2 }
        local still = rapid.create { points = rapid.points.grid { size = {1, 1, 1}, spacing = 0.5 } } :attribute { mass = 2 }
        return a:merge(b, still):gravity { g = {0, 1, 0} } :solve {})"},
    {"a pile with friction and spin, which falls asleep", R"(
        local r = 0.05
        return rapid.create { seed = 2, points = rapid.points.grid { size = {0.4, 0.3, 0.4}, spacing = 2.02 * r,
                              center = {0, 0.25, 0} } }
          :attribute { pscale = r }
          :points ("shake", function(p, frame)
              if frame.number == 2 then p.v = vec3(p:rand(1) - 0.5, 0, p:rand(2) - 0.5) * 0.3 end end)
          :gravity {}
          :collide { shape = rapid.shape.plane {}, bounce = 0, friction = 0.5 }
          :contact { friction = 0.4, spin = true, rolling = 0.1, record = true, bounce = 0.2 }
          :solve { substeps = 4, sleep = 0.1 })"},
    {"a drop of grains of two sizes onto others, with births among them", R"(
        return rapid.create { seed = 2 }
          :emit { source = rapid.shape.box { size = {0.4, 0.1, 0.4}, center = {0, 0.6, 0} }, from = "volume", rate = 200,
                  attributes = { pscale = {0.02, 0.05} } }
          :gravity {} :collide { shape = rapid.shape.plane {}, friction = 0.3 }
          :contact { friction = 0.4, mass_scaling = 1 } :solve { substeps = 3 })"},
    {"bonds that break", R"(
        local r = 0.05
        return rapid.create { seed = 2, points = rapid.points.grid { size = {0.3, 0.2, 0.3}, spacing = 2 * r,
                              center = {0, 0.3, 0} } }
          :attribute { pscale = r, mass = 0.1 }
          :points ("shake", function(p, frame)
              if frame.number % 3 == 2 then p.v = p.v + vec3(p:rand(1, frame) - 0.5, 0, p:rand(2, frame) - 0.5) * 2 end end)
          :gravity {} :collide { shape = rapid.shape.plane {}, bounce = 0 }
          :contact {} :clump { strength = 8 } :solve { substeps = 4 })"},
    {"a rope and a net with springs, pins and rods that break", R"(
        local points = rapid.points.grid { size = {1, 0.3, 0}, spacing = 0.1, center = {0, 1, 0} }
        return rapid.create { seed = 2, points = points }
          :group { name = "held", where = function(p) return p.P.x < -0.4 end }
          :group { name = "sprung", where = function(p) return p.P.x > 0.4 end }
          :points ("blow", function(p, frame) p.v = p.v + vec3(0, 0, 0.3 * p:rand(1, frame)) end)
          :gravity {}
          :pin { group = "held" } :pin { group = "sprung", target = {0.6, 1, 0}, compliance = 0.01 }
          :distance { within = 0.11, compliance = 1e-4, strain = 0.4 }
          :collide { shape = rapid.shape.sphere { radius = 0.2, center = {0, 0.6, 0} } }
          :solve { substeps = 4 })"},
    {"trees of rods on a body that moves", R"(
        local points = rapid.points.from { P = { {0, 1, 0}, {0.2, 1, 0}, {0.4, 1, 0}, {0.4, 0.8, 0}, {0.6, 1, 0} } }
        return rapid.create { seed = 2, points = points, subframes = 2 }
          :group { name = "held", where = function(p) return p.id == 0 end }
          :gravity {}
          :pin { group = "held", transform = function(frame) return rapid.translate(0.1 * math.sin(frame.number), 0, 0) end }
          :distance { pairs = { {1, 2}, {2, 3}, {3, 4}, {3, 5} } }
          :solve { substeps = 3 })"},
    {"forces among neighbours in sub-steps, and kernels within", R"(
        return rapid.create { seed = 4 }
          :emit { source = rapid.shape.sphere { radius = 0.3 }, from = "volume", impulse = { [1] = 60, [5] = 10 } }
          :interact { radius = 0.2, separation = 3, cohesion = 1, alignment = 2, drag = 1 }
          :action ("swirl", function(p, step) p.v = p.v + vec3(-p.P.z, 0, p.P.x) * step.dt end)
          :solve { substeps = 3 })"},
    {"a tolerance, springs and curves", R"(
        return rapid.create { seed = 4 }
          :emit { source = rapid.shape.sphere { radius = 0.3 }, rate = 100, life = 0.5, velocity = {1, 0, 0} }
          :spring { target = {0, 0, 0}, stiffness = 300 }
          :turbulence { amplitude = function(frame) return 5 + math.sin(frame.number) end }
          :solve { tolerance = 1e-4 })"},
    {"level sets that are widened for points that shrink again", R"(
        local ball = rapid.levelset.sphere { radius = 0.3, voxel = 0.05 }
        return rapid.create { seed = 4 }
          :emit { source = rapid.mesh.grid { size = {0.6, 0.6}, center = {0, 0.8, 0} }, rate = 200, life = 0.6,
                  velocity = {0, -1, 0} }
          :points ("shrink", function(p, frame) p.pscale = 0.3 * math.exp(-0.3 * frame.number) end)
          :gravity {}
          :collide { shape = ball, bounce = 0.3, friction = 0.2,
                     transform = function(frame) return rapid.translate(0, 0.02 * frame.number, 0) end }
          :solve { substeps = 2 })"},
    {"points that stick to a shape that turns, and slide off", R"(
        return rapid.create { seed = 4 }
          :emit { source = rapid.mesh.grid { size = {0.8, 0.8}, center = {0, 0.5, 0} }, rate = 150, velocity = {0, -2, 0} }
          :gravity {}
          :collide { shape = rapid.shape.sphere { radius = 0.3 }, response = "stick", adhesion = 40,
                     transform = function(frame) return rapid.rotate({0, 0, 1}, 20 * frame.number) end }
          :collide { shape = rapid.shape.plane { offset = -0.5 }, response = "slide", viscosity = 1, friction = 0.3 }
          :solve {})"},
    {"values of the whole set", R"(
        return rapid.create { seed = 4 }
          :emit { source = rapid.mesh.grid {}, rate = 50 }
          :detail ("count", function(points, frame)
              points.detail.total = (points.detail.total or 0) + #points
              points.detail.middle = #points > 0 and points:mean "P" or vec3(0, 0, 0)
              if frame.number % 3 == 0 then points:add { P = vec3(0, 1, 0) } end
            end)
          :points ("follow", function(p, frame) p.v = p.v + frame.detail.middle * 0.01 + vec3(frame.detail.total, 0, 0) * 1e-4 end)
          :solve {})"},
    {"values of the nearest place of a mesh that turns", R"(
        local sheet = rapid.mesh.from { points = {{-1, 0, -1}, {1, 0, -1}, {1, 0, 1}, {-1, 0, 1}},
                                        faces = {{1, 2, 3}, {1, 3, 4}}, values = { heat = {0, 1, 2, 3} } }
        return rapid.create { seed = 4 }
          :emit { source = rapid.mesh.grid {}, rate = 50 }
          :transfer { source = sheet:transform(function(frame) return rapid.rotate({0, 1, 0}, 20 * frame.number) end) }
          :points ("rise", function(p) p.v = p.v + vec3(0, p.heat * p.dt, 0) end)
          :solve {})"},
    {"births along a curve that deforms, and a force to another that moves", R"(
        local wave = rapid.curve.from { points = function(frame)
          return {{-1, math.sin(9 * frame.time), 0}, {0, 0.3, frame.time}, {1, 0, 0}} end }
        return rapid.create { seed = 4 }
          :emit { source = wave, rate = 50, speed = 0.2 }
          :curve_force { curve = wave:transform(function(frame) return rapid.rotate({0, 1, 0}, 9 * frame.number) end) }
          :solve {})"},
    {"a vector grid, and files on the way", R"(
        local up = rapid.grid.from { size = {4, 4, 4}, voxel = 1, at = function() return vec3(0, 1, 0) end }
        return rapid.create { seed = 4 }
          :emit { source = rapid.mesh.grid {}, rate = 50 }
          :field { grid = up }
          :curve_force { curve = function(frame) return {{-1, frame.time, 0}, {1, 0.5, frame.time}} end, radius = 1 }
          :write { file = "/nowhere/points.####.csv" }
          :rasterize { file = "/nowhere/points.####.vdb" }
          :group { name = "high", where = function(p) return p.P.y > 0 end }
          :solve {})"},
};

}  // namespace rapid::test
