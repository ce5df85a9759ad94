-- graphs/radius.lua: the claims in its header.
describe("graphs/radius.lua", function()
  local size = 0.1
  local result = rapid.run("graphs/radius.lua", { frames = {1, 48}, set = { size = size } })

  -- Returns the distance of a centre from a ring about the y axis through (x, 0.3, 0).
  local function from_ring(P, x)
    local around = math.sqrt((P.x - x) ^ 2 + P.z ^ 2) - 0.55
    return math.sqrt(around ^ 2 + (P.y - 0.3) ^ 2) - 0.16
  end

  it("lets middles to the surface without a radius, and surfaces with pscale", function()
    local points = result[48]
    assert.equal(28, #points)
    for i = 1, #points do
      local p = points[i]
      local right = p:within "side2"
      -- The level set of a tube has an error of about voxel² / tube: at most 6 mm.
      assert.near(right and size or 0, from_ring(p.P, right and 2 or 0), 0.006)
    end
  end)

  it("widens the narrowest band to what the radius needs, and says so in --stats", function()
    local command = require "testing.command"
    local folder = command.folder()
    local graph = command.shell("pwd").stdout:match "%S+" .. "/graphs/radius.lua"
    local ran = command.rapid(("run %s -f 1-8 --stats stats.json"):format(graph), { cwd = folder.path })
    assert.equal("", ran.stderr)
    local bands = {}
    for _, frame in ipairs(require "dkjson".decode(folder:read "stats.json").frames) do
      for _, band in ipairs(frame.bands or {}) do
        local known = bands[band.node] or { width = 0, seconds = 0 }
        bands[band.node] = { width = math.max(known.width, band.width), seconds = known.seconds + band.seconds,
          voxels = band.voxels }
      end
    end
    assert.near(0.06, bands.collide1.width, 1e-6)
    assert.equal(15532, bands.collide1.voxels)
    assert.equal(0, bands.collide1.seconds) -- built with the level set
    assert.near(0.16, bands.collide2.width, 1e-6)
    assert.equal(41213, bands.collide2.voxels)
    assert.truthy(bands.collide2.seconds > 0)
  end)
end)
