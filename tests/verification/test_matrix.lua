-- Checks that each row of the verification matrix (matrix.lua) holds. tests/run --thorough or VERIFICATION_LONG=1 also
-- measures long rows. VERIFICATION_ONLY is a word that a row's case, feature or law must contain, VERIFICATION_TABLE a
-- file to which the table is written. tests/verification/run sets them.
local amount = require "tests.amount"
local matrix = require "tests.verification.matrix"

local only = os.getenv "VERIFICATION_ONLY" or ""
local with_long = os.getenv "VERIFICATION_LONG" or amount.thorough
local measured = {}

describe("verification", function()
  for _, row in ipairs(matrix.rows()) do
    local words = row.case .. " " .. row.feature .. " " .. row.law
    if (with_long or not row.long) and words:find(only, 1, true) then
      it(("%s: %s"):format(row.feature, row.law), function()
        local figure, order = row.measure()
        local ok = matrix.holds(row, figure, order)
        measured[#measured + 1] = { row = row, figure = figure, order = order, ok = ok }
        assert.truthy(ok, ("%s: measured %s, order %s; it must be %s%s"):format(row.case, matrix.figure(row, figure),
          order or "none", matrix.tolerance(row), row.order and (", of order %g"):format(row.order) or ""))
      end)
    end
  end

  teardown(function()
    local path = os.getenv "VERIFICATION_TABLE"
    if not path then return end
    local file = assert(io.open(path, "w"))
    file:write(matrix.markdown(measured))
    file:close()
  end)
end)
