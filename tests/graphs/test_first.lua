-- graphs/first.lua: the claims in its header.
local torus_radius, tube, voxel = 0.6, 0.22, 0.02

-- Returns the distance to the torus that the scene's mesh approximates; mesh and level set lie within a voxel of it.
local function distance(P)
  local ring = math.sqrt(P.x * P.x + P.z * P.z) - torus_radius
  local y = P.y - 0.7
  return math.sqrt(ring * ring + y * y) - tube
end

describe("graphs/first.lua", function()
  local result = rapid.run("graphs/first.lua", { frames = {1, 72}, set = { rate = 2000 } })

  it("keeps every bead out of the torus and above the floor", function()
    for frame, points in result:frames() do
      for i = 1, #points do
        local P = points[i].P
        if P.y < -1e-6 or distance(P) < -voxel then
          error(("frame %d, id %d: inside at %s"):format(frame, points[i].id, tostring(P)))
        end
      end
    end
  end)

  it("emits floor(rate time) beads, and turns them by its wind", function()
    for _, frame in ipairs { 2, 13, 48 } do
      assert.equal(math.floor(2000 * (frame - 1) / 24), #result[frame])
    end
    -- The wind adds up x P: the spin about y is positive everywhere that beads fall freely.
    local spin, points = 0, result[24]
    for i = 1, #points do spin = spin + points[i].v:dot(vec3(0, 1, 0):cross(points[i].P)) end
    assert.is_true(spin / #points > 0.05)
  end)

  it("is bit-identical on one thread and on seven", function()
    for _, threads in ipairs { 1, 7 } do
      local again = rapid.run("graphs/first.lua", { frames = {30, 30}, set = { rate = 200000 }, threads = threads })
      local other = rapid.run("graphs/first.lua", { frames = {30, 30}, set = { rate = 200000 }, threads = 2 })
      assert.same_points(other[30], again[30])
    end
  end)
end)
