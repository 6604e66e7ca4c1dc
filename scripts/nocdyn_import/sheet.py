"""Mass-elastic sheets: CSV files with a row for each station and the shaft or coupling from it to another one."""

import csv
import re
from dataclasses import dataclass, field

from nocdyn_import.machine import FILES, Machine, Quantity, SourceError

# Columns: their own names first, then what else they are called, and the SI unit of their numbers ('' if they have none).
COLUMNS = {
    "station": (["station", "no", "no.", "nr", "#", "mass no", "mass no.", "node"], ""),
    "name": (["name", "description", "component"], ""),
    "inertia": (["inertia", "moment of inertia", "mass moment of inertia", "j", "i"], "kg m2"),
    "speed ratio": (["speed ratio", "ratio"], ""),
    "station damping": (["station damping", "external damping", "absolute damping"], "N m s/rad"),
    "connects to": (["connects to", "connected to", "to", "to station"], ""),
    "connection": (["connection", "coupling", "shaft"], ""),
    "stiffness": (["stiffness", "torsional stiffness", "k"], "N m/rad"),
    "damping": (["damping", "torsional damping", "viscous damping", "c"], "N m s/rad"),
    "relative damping": (["relative damping", "psi"], ""),
    "magnifier": (["magnifier", "dynamic magnifier"], ""),
    "damping frequency": (["damping frequency"], "rad/s"),
    "outer diameter": (["outer diameter", "diameter", "od"], "m"),
    "inner diameter": (["inner diameter", "bore", "id"], "m"),
    "length": (["length"], "m"),
    "shear modulus": (["shear modulus", "g"], "Pa"),
    "density": (["density"], "kg/m3"),
    "remarks": (["remarks", "remark", "notes", "comment"], ""),
}
TEXTS = {"station", "name", "connects to", "connection", "remarks"}
SHAFT = {
    "length": "lengths",
    "outer diameter": "diameters",
    "inner diameter": "bores",
    "shear modulus": "shear_modulus",
    "density": "density",
}
NEEDED = ("station", "inertia")
RELATIVE = ("relative damping", "magnifier", "damping frequency")
RIGID = {"rigid", "gear"}
NOTHING = {"-", "none"}
HEADING = re.compile(r"^(.*?)\s*(?:[\[(](.*)[\])])?$")
NUMBER = re.compile(r"^[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?$")


@dataclass
class Row:
    """The cells of a line, by column."""

    line: int
    cells: dict = field(default_factory=dict)

    def __getitem__(self, column):
        return self.cells.get(column, "")


def read_sheet(source):
    return Sheet(source).machine


class Sheet:
    """A sheet, its rows checked."""

    def __init__(self, source):
        self.source, self.wrong, self.notes = source, [], []
        self.units, self.headings = {}, {}
        try:
            self.rows = self.read_rows(self.read_text())
        except csv.Error as error:
            raise SourceError([f"{source}: not a sheet: {error}"]) from None
        self.stop_if_wrong()
        self.stations = self.find_stations()
        self.stop_if_wrong()
        self.machine = Machine(source, source.stem)
        self.machine.notes = self.notes
        self.write()
        self.stop_if_wrong()

    def fail(self, line, text):
        self.wrong.append(f"{self.source}:{line}: {text}")

    def stop_if_wrong(self):
        if self.wrong:
            raise SourceError(self.wrong)

    def read_text(self):
        data = self.source.read_bytes()
        if b"\0" in data:
            raise SourceError([f"{self.source}: not a text file"], FILES)
        try:
            return data.decode("utf-8-sig")
        except UnicodeDecodeError:
            return data.decode("latin-1")

    def read_rows(self, text):
        """The rows below the line of headings, which says what columns are separated by."""
        lines = [
            (number, line)
            for number, line in enumerate(text.splitlines(), 1)
            if line.strip() and line.lstrip()[0] not in "#!" and not line.lower().startswith("sep=")
        ]
        if not lines:
            raise SourceError([f"{self.source}: no line with headings; needed: {', '.join(NEEDED)}"])
        number, heading = lines[0]
        separator = ";" if ";" in heading else "\t" if "\t" in heading else ","
        columns = self.read_headings(number, next(csv.reader([heading], delimiter=separator)))
        rows = []
        for number, line in lines[1:]:
            cells = [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]
            if len(cells) > len(columns) and any(cells[len(columns) :]):
                self.fail(number, f"{len(cells)} cells; allowed: {len(columns)}, as headings" + decimal_hint(separator))
                continue
            row = Row(number, {column: cell for column, cell in zip(columns, cells, strict=False) if column})
            if separator != ",":
                for column in row.cells.keys() - TEXTS:
                    row.cells[column] = row.cells[column].replace(",", ".")
            if not rows and not NUMBER.match(row["inertia"]) and row["inertia"] and not NUMBER.match(row["station"]):
                self.units |= {column: cell.strip("[]()") for column, cell in row.cells.items() if column not in TEXTS and cell}
            elif any(cells):
                rows.append(row)
        self.tell_units()
        return rows

    def read_headings(self, number, cells):
        """The columns by their own names; those that are not known are told and left out."""
        columns = []
        for cell in cells:
            word, unit = HEADING.match(" ".join(cell.split())).groups()
            found = [column for column, (names, _) in COLUMNS.items() if word.lower().replace("_", " ") in names]
            if not found:
                if cell.strip():
                    self.notes.append(f"column {cell.strip()!r} is not imported; known: {', '.join(COLUMNS)}")
                columns.append(None)
                continue
            if found[0] in columns:
                self.fail(number, f"two columns {found[0]!r}")
            columns.append(found[0])
            self.headings[found[0]] = cell.strip()
            if unit is not None and found[0] not in TEXTS:
                self.units[found[0]] = unit.strip()
        for column in NEEDED:
            if column not in columns:
                self.fail(number, f"no column {column!r}; needed: {', '.join(NEEDED)}, and what connects the stations")
        return columns

    def tell_units(self):
        bare = [column for column in self.headings if COLUMNS[column][1] and column not in self.units]
        if bare:
            taken = ", ".join(f"{column} [{COLUMNS[column][1]}]" for column in bare)
            self.notes.append(f"headings without a unit, taken as {taken}")

    def find_stations(self):
        """The rows that are stations, by their numbers, which are texts; further rows of a station hold connections only."""
        stations = {}
        for row in self.rows:
            if not row["station"]:
                self.fail(row.line, "station: a row without one; needed: its number or sign")
            elif row["station"] not in stations:
                if not row["inertia"]:
                    self.fail(row.line, f"inertia of station {row['station']} is missing; 0 where a wheel is without any")
                stations[row["station"]] = row
            elif row["inertia"]:
                first = stations[row["station"]].line
                self.fail(
                    row.line,
                    f"station {row['station']} has an inertia on line {first} too; further rows of it hold connections only",
                )
        if not self.rows:
            self.fail(1, "no rows; needed: one for each station")
        return stations

    def number(self, row, column, factor=""):
        """The value of a cell as an input has it; lists are separated by '|'."""
        if not row[column]:
            return None
        values = []
        unit = self.units.get(column, COLUMNS[column][1])
        for cell in row[column].split("|"):
            cell = cell.strip()
            if not NUMBER.match(cell):
                self.fail(
                    row.line, f"{self.headings[column]} = {cell!r} is not a number" + (f"; allowed: {factor}" if factor else "")
                )
                return None
            value = float(re.sub("[dD]", "e", cell))
            values.append(value if unit in (COLUMNS[column][1], "1") else Quantity(f"{cell} {unit}"))
        return values if len(values) > 1 else values[0]

    def write(self):
        taken, self.names = set(), {}
        for station, row in self.stations.items():
            self.names[station] = self.machine.own_name(row["name"] or f"station {station}", taken, "station")
            place = f"{self.source}:{row.line}"
            inertia = self.number(row, "inertia")
            self.machine.add(
                place, "body", {"inertia": self.headings["inertia"]}, row["remarks"], name=self.names[station], inertia=inertia
            )
        self.taken = set()
        for row, following in zip(self.rows, [*self.rows[1:], None], strict=True):
            self.connect(row, following)
        if len(self.stations) > 1 and not self.taken:
            self.machine.note("no station is connected to another one")
        for station, row in self.stations.items():
            damping = self.number(row, "station damping")
            if damping:
                name = f"damping of {self.names[station]}"[:63]
                called = {"viscous": self.headings["station damping"]}
                self.machine.add(
                    f"{self.source}:{row.line}", "load", called, name=name, body=self.names[station], viscous=damping
                )

    def connect(self, row, following):
        """What goes from a station to another one."""
        is_shaft = not row["stiffness"] and row["length"]
        target = row["connects to"]
        if target.lower() in NOTHING:
            return
        if not target:
            if not (row["stiffness"] or is_shaft):
                return
            if following is None:
                self.fail(row.line, "a connection behind the last row; needed: its station in 'connects to'")
                return
            target = following["station"]
        if target.lower() == "ground":
            other = "ground"
        elif target in self.stations and target != row["station"]:
            other = self.names[target]
        else:
            known = ", ".join(self.stations)
            self.fail(row.line, f"connects to = {target!r} is no other station; allowed: {known}, ground, - for none")
            return
        own = self.names[row["station"]]
        ends = {
            "name": self.machine.own_name(row["connection"] or f"{own} to {other}"[:59], self.taken, "connection"),
            "bodies": [own, other],
        }
        if row["stiffness"].lower() in RIGID:
            self.add_gear(row, target, ends)
        elif is_shaft:
            self.add_shaft(row, ends)
        elif row["stiffness"]:
            self.add_coupling(row, target, ends)
        else:
            self.fail(
                row.line, "a connection without stiffness; needed: stiffness, 'gear', or length and outer diameter of a shaft"
            )

    def ratios(self, row, target):
        """The speed ratios of both ends; 1 where the sheet has none."""
        ends = [row["station"], target]
        if "ground" in ends[1].lower():
            return [1.0, 1.0]
        return [float(self.number(self.stations[end], "speed ratio") or 1.0) for end in ends]

    def add_gear(self, row, target, ends):
        if target.lower() == "ground":
            self.fail(row.line, "stiffness = 'gear' to the ground; needed: a station")
            return
        first, second = self.ratios(row, target)
        self.machine.note(f"{ends['name']}: only the ratio is known; tooth forces need the radii or numbers of teeth")
        place = f"{self.source}:{row.line}"
        called = dict.fromkeys(["radii", "bodies"], self.headings.get("speed ratio", "speed ratio"))
        internal = True if first * second > 0 else None
        self.machine.add(place, "gear", called, **ends, radii=[abs(second), abs(first)], internal=internal)

    def add_shaft(self, row, ends):
        called = self.called(SHAFT)
        values = {key: self.number(row, column) for column, key in SHAFT.items()}
        values |= self.relative_damping(row, ends)
        for column in ("damping", "magnifier"):
            if self.number(row, column):
                self.fail(row.line, f"{self.headings[column]} of a shaft with a length; allowed: relative damping")
        self.machine.add(f"{self.source}:{row.line}", "shaft", called, **ends, **values)

    def called(self, columns):
        """Keys of the input, as the sheet calls them."""
        damping = {column: column.replace(" ", "_") for column in RELATIVE}
        return {key: self.headings.get(column, column) for column, key in (columns | damping).items()}

    def relative_damping(self, row, ends):
        """The damping that data sheets give, which needs a frequency over the time."""
        values = {column.replace(" ", "_"): self.number(row, column) for column in RELATIVE}
        if (values["relative_damping"] or values["magnifier"]) and not values["damping_frequency"]:
            self.machine.note(f"{ends['name']}: nocdyn run needs a damping frequency beside the relative damping")
        return values

    def add_coupling(self, row, target, ends):
        first, second = self.ratios(row, target)
        if abs(first - second) > 1e-12 * abs(first):
            self.fail(
                row.line,
                f"a stiffness between speed ratios {first:g} and {second:g}; needed: 'gear', or stations of one ratio",
            )
            return
        columns = {
            "stiffness": "stiffness",
            "damping": "damping",
            "outer diameter": "diameter",
            "inner diameter": "bore",
        }
        called = self.called(columns)
        values = {
            key: self.number(row, column, "a number, or 'gear'" if key == "stiffness" else "") for column, key in columns.items()
        }
        values |= self.relative_damping(row, ends)
        if not row["outer diameter"]:
            values["bore"] = None
        self.machine.add(f"{self.source}:{row.line}", "coupling", called, **ends, **values)


def decimal_hint(separator):
    return "; decimal commas need semicolons or tabs between the cells" if separator == "," else ""
