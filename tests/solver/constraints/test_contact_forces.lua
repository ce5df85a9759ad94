-- contact { record }: the forces of contacts as attributes.
local scene = require "testing.scene"

-- Nine columns of grains on nine fixed grains, between smooth walls.
local silo = [[
local P, held = {}, {}
for k = 0, 53 do
  P[k + 1] = { 0.2 * (k % 3), 0.2 * math.floor(k / 9), 0.2 * (math.floor(k / 3) % 3) }
  held[k + 1] = k < 9 and 1 or 0
end
local chain = rapid.create { fps = 24, points = rapid.points.from { P = P, held = held } }
  :attribute { pscale = 0.1, mass = 0.5 }
  :group { name = "floor", where = function(p) return p.held == 1 end }
  :gravity {} :pin { group = "floor" }
for _, normal in ipairs { {1, 0, 0}, {-1, 0, 0}, {0, 0, 1}, {0, 0, -1} } do
  local offset = normal[1] + normal[3] > 0 and -0.1 or -0.5
  chain = chain:collide { bounce = 0, shape = rapid.shape.plane { normal = normal, offset = offset } }
end
return chain :contact { friction = 0.4, RECORD } :solve { substeps = 12, sleep = math.huge }]]

local function run(record) return scene.run(silo:gsub("RECORD", record), { frames = {48, 48} })[48] end

describe("record of contact", function()
  it("has the weight of a silo's grain on its floor", function()
    local points = run "record = true"
    local load, contacts = 0, 0
    for i = 1, #points do
      if points[i].held == 1 then load, contacts = load + points[i].normalforce, contacts + points[i].contactnum end
    end
    assert.near(45 * 0.5 * 9.81, load, 0.002 * 45 * 0.5 * 9.81)
    assert.equal(9, contacts)
  end)

  it("makes no attribute without record = true", function()
    assert.falsy(pcall(function() return run("record = false")[1].normalforce end))
  end)

  it("is true or false", function()
    local text = "return rapid.create {} :contact { record = 3 } :solve {}"
    assert.match('record = 3 has the wrong type', scene.error(text))
  end)
end)
