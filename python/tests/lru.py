"""The policy of docs/use/python.md."""


class LRU:
    """Least recently used, with a list per set."""

    def __init__(self, sets, ways):
        self.used = [[] for _ in range(sets)]

    def hit(self, set, way, line):
        self.used[set].remove(way)
        self.used[set].append(way)

    def fill(self, set, way, line):
        if way in self.used[set]:
            self.used[set].remove(way)
        self.used[set].append(way)

    def victim(self, set):
        return self.used[set][0]
