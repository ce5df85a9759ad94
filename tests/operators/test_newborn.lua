-- Attributes of initial points: points born without them get the default of a known name.
local scene = require "testing.scene"

describe("newborn points among initial ones with attributes of their own", function()
  local born = [[
return rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0, 0}, {1, 0, 0}}, mass = {2, 3},
    pscale = {0.1, 0.2}, life = {5, 6}, hitpath = {7, 8}, Cd = {{1, 0, 0}, {0, 1, 0}}, heat = {4, 4} } }
  :emit { source = rapid.points.from { P = {{0, 5, 0}} }, impulse = { [2] = 1 }, birth = "end" }]]

  -- Without nodes that would reject a wrong mass.
  it("have the defaults of known names, zero of others, and white", function()
    local points = scene.run(born, { frames = {2, 2} })
    local p = points[2][3]
    assert.equal(1, p.mass)
    assert.equal(0, p.pscale)
    assert.equal(math.huge, p.life)
    assert.equal(-1, p.hitpath)
    assert.equal(vec3(1, 1, 1), p.Cd)
    assert.equal(0, p.heat)
    assert.equal(2, points[2][1].mass)
  end)

  it("move as points of 1 kg do", function()
    local p = scene.run(born .. " :spring { stiffness = 6 } :contact {} :solve {}", { frames = {3, 3} })[3][3]
    assert.near(5 * math.cos(math.sqrt(6) / 24), p.P.y, 1e-6)
  end)
end)

-- Lua may take any of these keys without a successor for the length of the table.
describe("numbered keys that do not begin with 1", function()
  it("are keys, whatever Lua counts of them", function()
    for _, keys in ipairs { "[2] = 1, [14] = 2, [26] = 3", "[2] = 1, [3] = 4, [4] = 5", "[8] = 1, [16] = 2" } do
      local result = scene.run(("return rapid.create {} :emit { source = two, impulse = { %s } } :solve {}")
        :format(keys), { frames = {1, 26} })
      local count = 0
      for frame = 1, 26 do
        count = count + tonumber(keys:match(("%%[%d%%] = (%%d+)"):format(frame)) or 0)
        assert.equal(count, #result[frame])
      end
    end
  end)
end)

describe("points created inside each other", function()
  local function warnings(text)
    return table.concat(scene.run(text, { frames = {1, 4} }).warnings, "\n")
  end

  it("are reported with the node :contact, if it cannot separate them within the frame", function()
    for _, text in ipairs {
      "return rapid.create {} :emit { source = rapid.shape.sphere { radius = 0.02 }, count = 400 }\n"
        .. ":contact { radius = 0.02 }\n:solve {}",
      "local P = {} for k = 1, 400 do P[k] = {k % 20 * 1e-3, k * 5e-5, 0} end "
        .. "return rapid.create { points = rapid.points.from { P = P } }\n:contact { radius = 0.02 }\n:solve {}",
    } do
      local reported = warnings(text)
      assert.truthy(reported:find('scene.lua:2: node "contact1": points are created inside each other; give it a '
        .. "smaller radius, or create fewer points, farther apart", 1, true), reported)
    end
  end)

  it("are not reported if they are created apart, or if they are pressed together later", function()
    assert.equal("", warnings [[
local P = {}
for k = 1, 100 do P[k] = {k * 0.05, 0, 0} end
return rapid.create { points = rapid.points.from { P = P } } :contact { radius = 0.02 } :solve {}]])
    local pressed = warnings [[
local P, pairs = {}, {}
for k = 1, 20 do P[k] = {0.1 * k, 0, 0} end
for k = 1, 19 do pairs[k] = {k, k + 1} end
return rapid.create { points = rapid.points.from { P = P } } :contact { radius = 0.049 }
  :distance { pairs = pairs, rest = 0.05, collide = true } :solve {}]]
    assert.truthy(pressed:find('node "solve1": some constraints are violated', 1, true), pressed)
    assert.falsy(pressed:find("created inside", 1, true), pressed)
  end)
end)
