-- The verification matrix compares Rapid's results with known ones, one law per row.
--
-- Each file in `cases` returns a list of rows:
--
--   feature, law       the feature under test, and the law that must hold
--   reference          the source of the truth: a closed form, a publication, an independent computation
--   measure()          returns the figure, and the observed order of convergence if `order` is asserted
--   unit               of the figure; nil for a ratio
--   at_least, at_most  the tolerance: bounds of the figure
--   order              the smallest order of convergence that is asserted, less 0.2 for its fit
--   long               true if it takes more than about ten seconds: measured only if long rows are requested
local matrix = {}

local folder = "tests/verification/cases"

function matrix.rows()
  local rows = {}
  local pipe = assert(io.popen("ls " .. folder .. "/*.lua"))
  for path in pipe:lines() do
    local case = path:match "([%w_]+)%.lua$"
    for _, row in ipairs(require("tests.verification.cases." .. case)) do
      row.case = case
      rows[#rows + 1] = row
    end
  end
  pipe:close()
  return rows
end

local fit = 0.2  -- tolerance of an observed order

-- Returns true if a figure and an order are within a row's bounds. NaN never is.
function matrix.holds(row, figure, order)
  return figure == figure and figure >= (row.at_least or -math.huge) and figure <= (row.at_most or math.huge)
    and (not row.order or order and order >= row.order - fit)
end

-- Returns the least-squares slope of log error over log step. Errors below `rounding` are ignored. Returns infinity,
-- which means exact, if fewer than two remain.
function matrix.order(steps, errors, rounding)
  local n, sx, sy, sxx, sxy = 0, 0, 0, 0, 0
  for i, error in ipairs(errors) do
    if error > (rounding or 0) then
      local x, y = math.log(steps[i]), math.log(error)
      n, sx, sy, sxx, sxy = n + 1, sx + x, sy + y, sxx + x * x, sxy + x * y
    end
  end
  return n < 2 and math.huge or (n * sxy - sx * sy) / (n * sxx - sx * sx)
end

local function number(x) return ("%.4g"):format(x):gsub("e([+-])0*(%d)", "e%1%2"):gsub("e%+", "e") .. "" end

function matrix.tolerance(row)
  local low, high = row.at_least and number(row.at_least), row.at_most and number(row.at_most)
  local text = low and high and low .. " to " .. high or low and ">= " .. low or "<= " .. high
  return row.unit and text .. " " .. row.unit or text
end

function matrix.figure(row, figure)
  return row.unit and number(figure) .. " " .. row.unit or number(figure)
end

local function line(cells) return "| " .. table.concat(cells, " | ") .. " |\n" end

-- measured: for each row { row, figure, order, ok }.
function matrix.markdown(measured)
  local text = line { "feature", "law", "reference", "tolerance", "measured", "order", "holds" }
    .. "|---|---|---|---|---|---|---|\n"
  for _, m in ipairs(measured) do
    local order = m.row.order and (m.order < math.huge and ("%.2f (%g)"):format(m.order, m.row.order) or "exact") or ""
    text = text .. line { m.row.feature, m.row.law, m.row.reference, matrix.tolerance(m.row),
      matrix.figure(m.row, m.figure), order, m.ok and "yes" or "**no**" }
  end
  return text
end

return matrix
