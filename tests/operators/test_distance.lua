-- distance and pin in scenes: pairs by index and by proximity, rest, breaking, pinning; and wrong input.
local csv_rows = require "tests.csv_rows"
local json = require "dkjson"
local scene = require "testing.scene"

local function points_of(result, frame)
  return result[frame or #result]
end

describe("distance", function()
  it("keeps named pairs at the distance that they had at first, and a pin holds one end", function()
    local result = scene.run([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0, 0}, {0.3, -0.4, 0}, {0.6, -0.8, 0}} } }
  :gravity {} :distance { pairs = {{1, 2}, {2, 3}} }
  :group { name = "top", where = function(p) return p.id == 0 end }
  :pin { group = "top" } :solve { substeps = 8 }]], { frames = {1, 48} })
    for f = 2, 48 do
      local p = points_of(result, f)
      assert.near({0, 0, 0}, p[1].P, 1e-6)
      assert.near(0.5, (p[1].P - p[2].P):length(), 1e-4)
      assert.near(0.5, (p[2].P - p[3].P):length(), 1e-4)
    end
  end)

  it("has what rests on a compliant pin stretch it by its weight", function()
    for _, case in ipairs { {1e-4, 12, 4}, {1e-3, 12, 4}, {1e-3, 12, 50}, {5e-3, 24, 2} } do
      local give, substeps, iterations = unpack(case)
      local result = scene.run(([[
local pin = rapid.points.from { P = {{0, 0, 0}, {0, 0.02, 0}}, pscale = {0.01, 0.01}, mass = {0.01, 0.02} }
return rapid.create { fps = 24, points = pin }
  :group { name = "floor", where = function(p) return p.id == 0 end }
  :gravity {} :drag { linear = 5 } :pin { group = "floor", compliance = %g }
  :contact {} :solve { substeps = %d, iterations = %d, sleep = math.huge }]]):format(give, substeps, iterations),
        { frames = {1, 120} })
      local sag, count = 0, 0
      for f = 73, 120 do sag, count = sag - points_of(result, f)[1].P.y, count + 1 end
      assert.near(give * 0.03 * 9.81, sag / count, 0.005 * give * 0.03 * 9.81)
    end
  end)

  it("stretches a compliant pin by what lies on it, however heavy, few the sub-steps, or first the contact", function()
    local give, light = 1e-3, 0.1
    for _, case in ipairs { {1, 1, 0.02}, {10, 1, 0.03}, {100, 1, 0.04}, {100, 2, 0.02}, {100, 12, 0.002} } do
      local ratio, substeps, allowed = unpack(case)
      local heavy = light * ratio
      for _, nodes in ipairs { ":pin { group = 'floor', compliance = %g } :contact {}",
                               ":contact {} :pin { group = 'floor', compliance = %g }" } do
        local result = scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0, 0}, {0, 0.2, 0}}, pscale = {0.1, 0.1},
    mass = {%g, %g} } }
  :group { name = "floor", where = function(p) return p.id == 0 end }
  :gravity {} :drag { linear = 5 } %s :solve { substeps = %d, iterations = 1, sleep = math.huge }]]):format(light,
          heavy, nodes:format(give / heavy), substeps), { frames = {1, 120} })
        local sag, count = 0, 0
        for f = 73, 120 do
          local held, lying = result[f][1].P, result[f][2].P
          sag, count = sag - held.y, count + 1
          assert.near(0.2, lying.y - held.y, 1e-3)
        end
        assert.near(1, sag / count / (give / heavy * (light + heavy) * 9.81), allowed)
      end
    end
  end)

  it("acts together with a contact, in either order", function()
    local function last(nodes)
      local result = scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, -1, 0}, {0, 0, 0}, {0.05, 0.2, 0}},
    pscale = {0.1, 0.1, 0.1}, mass = {1, 0.1, 1} } }
  :group { name = "foot", where = function(p) return p.id == 0 end }
  :group { name = "grains", where = function(p) return p.id > 0 end }
  :gravity {} :pin { group = "foot" } %s :solve { substeps = 4 }]]):format(nodes), { frames = {1, 12} })
      return result[12][2].P, result[12][3].P
    end
    local contact, rod = ":contact { group = 'grains' }", ":distance { pairs = {{1, 2}}, compliance = 1e-4 }"
    local a, b = last(contact .. rod)
    local c, d = last(rod .. contact)
    assert.near(a, c, 0)
    assert.near(b, d, 0)
  end)

  it("holds a chain of 1,000 links that swings to a strain of a thousandth by 4 sub-steps", function()
    local result = scene.run([[
local places, links = {}, {}
for k = 1, 1001 do
  places[k] = {0.1 * (k - 1), 0, 0}
  if k > 1 then links[k - 1] = {k - 1, k} end
end
return rapid.create { fps = 24, points = rapid.points.from { P = places } }
  :gravity {} :distance { pairs = links } :group { name = "top", where = function(p) return p.id == 0 end }
  :pin { group = "top" } :solve { substeps = 4 }]], { frames = {1, 72} })
    local worst = 0
    for f = 2, 72, 5 do
      local points = result[f]
      for k = 2, #points do
        worst = math.max(worst, math.abs((points[k].P - points[k - 1].P):length() / 0.1 - 1))
      end
    end
    assert.truthy(worst < 1e-3, worst)
  end)

  it("lets a net fall and swing, however stiff its springs are to the sub-steps", function()
    local function lowest(compliance, substeps)
      local result = scene.run(([[
        local P, pairs = {}, {}
        for k = 0, 143 do
          local i, j = k %% 12, math.floor(k / 12)
          P[k + 1] = {0.1 * i, 0, 0.1 * j}
          if i > 0 then pairs[#pairs + 1] = {k, k + 1} end
          if j > 0 then pairs[#pairs + 1] = {k - 11, k + 1} end
        end
        return rapid.create { fps = 24, points = rapid.points.from { P = P } } :gravity {}
          :group { name = "held", where = function(p) return p.id == 0 or p.id == 11 end } :pin { group = "held" }
          :distance { pairs = pairs, compliance = %g } :solve { substeps = %d, sleep = math.huge }]])
        :format(compliance, substeps), { frames = {1, 16} })
      return result[12]:min("P").y, result[16]:min("P").y
    end
    local rods = lowest(0, 16)
    assert.near(-1.03, rods, 0.02) -- almost as far as in free fall
    for _, compliance in ipairs { 1e-8, 1e-7, 1e-6, 1e-5 } do
      assert.near(rods, lowest(compliance, 4), 0.03, ("%g"):format(compliance))
      local _, coarse = lowest(compliance, 16)
      local _, fine = lowest(compliance, 64)
      assert.near(fine, coarse, 0.06, ("%g, on its way up"):format(compliance))
    end
  end)

  it("joins all pairs that are near at the start, at the given distance", function()
    local p = points_of(scene.run([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0, 0}, {1, 0, 0}, {3, 0, 0}} } }
  :distance { within = 1.5, rest = 0.5 } :solve { iterations = 4 }]], { frames = {1, 4} }), 4)
    assert.near(0.5, (p[1].P - p[2].P):length(), 1e-6)
    assert.near({3, 0, 0}, p[3].P, 0)
  end)

  it("breaks pairs that are stretched by more than the strain, permanently", function()
    -- A weight on a spring: stretched by 2 compliance m g at the lowest point of its oscillation.
    local stretched = 2 * 0.01 * 9.81
    local function lowest(strain)
      local least = 0
      local result = scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0, 0}, {0, -1, 0}} } }
  :gravity {} :distance { pairs = {{1, 2}}, compliance = 0.01, strain = %g }
  :group { name = "top", where = function(p) return p.id == 0 end } :pin { group = "top" }
  :solve { substeps = 20 }]]):format(strain), { frames = {1, 48} })
      for f = 1, 48 do least = math.min(least, result[f][2].P.y) end
      return least
    end
    assert.near(-1 - stretched, lowest(1.05 * stretched), 0.01)
    assert.truthy(lowest(0.5 * stretched) < -10)
  end)

  -- A weight on a rod of length L, released while the rod is level: at the angle φ below, v² = 2 g L sin φ, and the
  -- rod pulls with 3 m g sin φ.
  local function swinging(arguments)
    return ([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0, 0}, {0.5, 0, 0}}, mass = {1, 10} } }
  :gravity {} :distance { pairs = {{1, 2}}, %s }
  :group { name = "top", where = function(p) return p.id == 0 end } :pin { group = "top" }
  :solve { substeps = 40 }]]):format(arguments)
  end
  local most = 3 * 10 * 9.81 -- N, at the lowest point

  it("breaks a rod that pulls with more than its strength, at that moment", function()
    for _, part in ipairs { 0.3, 0.8 } do
      local result = scene.command("run", swinging("strength = " .. part * most),
        "-f 1-20 --events e.csv --stats s.json")
      assert.equal(0, result.status, result.stderr)
      local ends = {}
      for _, row in ipairs(csv_rows(scene.folder:read "e.csv")) do
        if row.event == 3 then ends[#ends + 1] = row end
      end
      assert.equal(2, #ends)
      assert.same({ 0, 1 }, { ends[1].id, ends[2].id })
      assert.near(-part * 0.5, ends[2].Py, 0.01) -- a substep is a hundredth of the swing
      assert.near(math.sqrt(2 * 9.81 * 0.5 * part), math.sqrt(ends[2].vx ^ 2 + ends[2].vy ^ 2), 0.02)
      for _, frame in ipairs(json.decode(scene.folder:read "s.json").frames) do
        assert.equal(frame.frame == ends[1].frame and 1 or nil, frame.broken)
      end
    end
  end)

  it("holds a rod that never pulls with as much", function()
    local result = scene.command("run", swinging("strength = " .. 1.02 * most),
      "-f 1-40 --events e.csv --stats s.json")
    assert.equal(0, result.status)
    for _, frame in ipairs(json.decode(scene.folder:read "s.json").frames) do assert.is_nil(frame.broken) end
    for _, row in ipairs(csv_rows(scene.folder:read "e.csv")) do assert.not_equal(3, row.event) end
  end)

  it("breaks a spring by its strength where a strain does that is as large", function()
    local function frames(arguments)
      return scene.run(swinging("compliance = 1e-4, " .. arguments), { frames = {1, 24} })
    end
    -- 0.04 of 0.5 m by 1e-4 m/N
    local by_strength, by_strain = frames "strength = 200", frames "strain = 0.04"
    local function breaks_in(result)
      for f = 1, 24 do
        if (result[f][1].P - result[f][2].P):length() > 0.53 then return f end
      end
    end
    assert.truthy(breaks_in(by_strain))
    assert.near(breaks_in(by_strain), breaks_in(by_strength), 1)
  end)

  it("warns of a rod that is to break by a strain", function()
    local text = "strain = 0.02 breaks no rod, because no load stretches a rigid pair; give it a compliance, or " ..
      "give strength"
    local function warnings(arguments)
      return table.concat(scene.run(swinging(arguments), { frames = {1, 3} }).warnings, "\n")
    end
    assert.truthy(warnings("strain = 0.02"):find(text, 1, true))
    assert.equal("", warnings "strain = 0.02, compliance = 1e-4")
    assert.equal("", warnings "strain = 0.02, strength = 500")
  end)

  it("follows its points by id when others die", function()
    local p = points_of(scene.run([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{9, 9, 9}, {0, 0, 0}, {1, 0, 0}} } }
  :distance { pairs = {{2, 3}} } :delete { where = function(p, frame) return p.id == 0 and frame.number == 5 end }
  :action("pull", function(p) if p.id == 2 then p.v = p.v + vec3(1, 0, 0) end end)
  :solve {}]], { frames = {1, 24} }), 24)
    assert.equal(2, #p)
    assert.near(1, (p[1].P - p[2].P):length(), 1e-4)
  end)

  it("reports wrong pairs", function()
    local function wrong(arguments)
      return scene.error(("return rapid.create { points = two } :distance { %s } :solve {}"):format(arguments))
    end
    assert.matches("neither pairs nor within is given; give one of them", wrong "", 1, true)
    assert.matches("both pairs and within are given; remove one of them", wrong "pairs = {{1, 2}}, within = 1", 1, true)
    assert.matches("pairs names point 3, but the set that first enters the node has points 1 to 2",
      wrong "pairs = {{1, 3}}", 1, true)
    assert.matches("pairs connects point 2 to itself; give two points", wrong "pairs = {{2, 2}}", 1, true)
    assert.matches("pairs has an entry of 3 numbers; each must be two indices, {i, j}", wrong "pairs = {{1, 2, 1}}", 1,
      true)
  end)
end)

describe("pin", function()
  it("takes a point along a motion, with its velocity", function()
    local result = scene.run([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{1, 0, 0}} } }
  :gravity {}
  :pin { transform = function(frame) return rapid.rotate({0, 1, 0}, 15 * (frame.number - 1)) end }
  :solve { substeps = 4 }]], { frames = {1, 13} })
    local angle = math.rad(15 * 12)
    assert.near({math.cos(angle), 0, -math.sin(angle)}, result[13][1].P, 1e-5)
    local speed = math.rad(15) * 24
    assert.near({-speed * math.sin(angle), 0, -speed * math.cos(angle)}, result[13][1].v, 1e-3)
  end)

  it("is pulled to the position in an attribute", function()
    local p = points_of(scene.run([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{1, 0, 0}, {2, 0, 0}},
    home = {{5, 5, 5}, {6, 6, 6}} } } :gravity {} :pin { target = rapid.attr "home" } :solve {}]],
      { frames = {1, 3} }), 3)
    assert.near({5, 5, 5}, p[1].P, 0)
    assert.near({6, 6, 6}, p[2].P, 0)
    assert.near({0, 0, 0}, p[2].v, 0)
  end)

  it("gives by its compliance: a weight of m g hangs compliance m g below", function()
    local p = points_of(scene.run([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0, 0}}, mass = {2} } }
  :gravity {} :drag { linear = 20 } :pin { compliance = 1e-3 }
  :solve { substeps = 2, sleep = math.huge }]], { frames = {1, 96} }), 96)
    assert.near({0, -2 * 9.81 * 1e-3, 0}, p[1].P, 1e-6)
  end)
end)

describe("a rope of beads that overlap", function()
  local function rope(contact, collide)
    return scene.run(([[
local P, pairs = {}, {}
for k = 1, 20 do P[k] = {0.09 * k, 2, 0}; if k > 1 then pairs[k - 1] = {k - 1, k} end end
return rapid.create { points = rapid.points.from { P = P } } :attribute { pscale = 0.06 }
  :group { name = "hook", where = function(p) return p.id == 0 end }
  :gravity {} :drag { linear = 1 } :pin { group = "hook" } :distance { pairs = pairs, collide = %s } %s
  :solve { substeps = 10 }]]):format(collide, contact), { frames = {1, 72} })
  end

  it("moves as without contacts between the two beads of a pair, which do not collide unless asked to", function()
    local without, with = rope("", "false")[72], rope(":contact {}", "false")[72]
    for i = 1, 20 do assert.near(without[i].P, with[i].P, 1e-3) end
    local pushed = rope(":contact {}", "true")
    assert.truthy((pushed[72][20].P - without[20].P):length() > 0.1)
    assert.matches('node "solve1": some constraints are violated by more than a tenth of their size',
      table.concat(pushed.warnings, "\n"), 1, true)
  end)

  it("gains nothing out of rest from springs in an overlap", function()
    for _, substeps in ipairs { 1, 16, 64 } do
      local result = scene.run(([[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0,0,0}, {1,0,0}, {0.5,0.9,0.1}},
    pscale = {0.6, 0.6, 0.6} } }
  :distance { compliance = 1e-5, within = 1.2 } :contact { spin = true, bounce = 0.5, friction = 0.3 }
  :solve { substeps = %d }]]):format(substeps), { frames = {1, 72} })
      for i = 1, 3 do assert.near(0, result[72][i].v:length(), 1e-3) end
    end
  end)
end)

describe("a tolerance", function()
  it("is refused where points are coupled", function()
    local errors = scene.error "return rapid.create { points = two } :contact {} :solve { tolerance = 1e-3 }"
    assert.matches("a tolerance needs independent points, but there are constraints; give substeps instead", errors, 1,
      true)
  end)
end)
