-- Returns the rows of a .csv file's text as tables by column, and the names of the columns.
--
--   local csv_rows = require "tests.csv_rows"      from the folder of the project
return function(text)
  local rows, header = {}, nil
  for line in text:gmatch "[^\n]+" do
    local cells = {}
    for cell in line:gmatch "[^,]+" do cells[#cells + 1] = cell end
    if not header then
      header = cells
    else
      local row = {}
      for i, name in ipairs(header) do row[name] = tonumber(cells[i]) end
      rows[#rows + 1] = row
    end
  end
  return rows, header
end
