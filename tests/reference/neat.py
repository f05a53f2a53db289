"""NEAT with dictionaries, one individual and one gene at a time.

Written from Stanley & Miikkulainen (2002) and the descriptions of `NeatSettings`. It draws the same random
numbers as the kernels, so the order of draws is theirs; each is marked where it is made.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from realitygap.evolution import NeatSettings

from .philox import CHILD, GENOME, SPECIES, Stream


@dataclass
class Gene:
    """A connection gene."""

    source: int
    target: int
    weight: float
    enabled: bool = True

    @property
    def link(self) -> tuple[int, int]:
        return self.source, self.target


@dataclass
class Genome:
    """Connection genes by innovation number; output and hidden nodes with their biases."""

    genes: dict[int, Gene] = field(default_factory=dict)
    biases: dict[int, float] = field(default_factory=dict)

    def links(self) -> set[tuple[int, int]]:
        return {gene.link for gene in self.genes.values()}

    def enabled(self) -> list[Gene]:
        return [gene for _, gene in sorted(self.genes.items()) if gene.enabled]


def has_cycle(links: Iterable[tuple[int, int]]) -> bool:
    """Whether something is left when links that lead nowhere are taken away again and again."""
    left = set(links)
    while left:
        sources = {source for source, _ in left}
        onward = {link for link in left if link[1] in sources}
        if onward == left:
            return True
        left = onward
    return False


@dataclass
class History:
    """What arose in this generation, and the next numbers to be given."""

    next_number: int
    next_node: int
    links: dict[tuple[int, int], int] = field(default_factory=dict)
    splits: dict[int, tuple[int, int]] = field(default_factory=dict)

    def number_of_link(self, link: tuple[int, int]) -> int:
        if link not in self.links:
            self.links[link] = self.next_number
            self.next_number += 1
        return self.links[link]

    def split(self, number: int) -> tuple[int, int]:
        """The node that splits a gene, and the number of the link into it; the one out has the next."""
        if number not in self.splits:
            self.splits[number] = self.next_node, self.next_number
            self.next_node += 1
            self.next_number += 2
        return self.splits[number]

    def forget(self) -> None:
        self.links.clear()
        self.splits.clear()


@dataclass
class Species:
    """A species; its members are those whose entry in `species_of` is its identity."""

    identity: int
    improved: int
    best: float = -math.inf


@dataclass
class Neat:
    """The rules of NEAT for one task."""

    settings: NeatSettings
    n_inputs: int  # the constant one counted
    n_outputs: int
    bias_input: int | None = None

    @property
    def outputs(self) -> range:
        return range(self.n_inputs, self.n_inputs + self.n_outputs)

    @property
    def first_hidden(self) -> int:
        return self.n_inputs + self.n_outputs

    def hidden(self, genome: Genome) -> list[int]:
        return sorted(node for node in genome.biases if node >= self.first_hidden)

    def history(self) -> History:
        hidden = self.settings.start_hidden
        return History(len(self.first_links()), self.first_hidden + hidden)

    def first_links(self) -> list[tuple[int, int]]:
        """Links that a start can have, by number: input to output; by hidden node, those into it and out of it.

        A link between hidden nodes leads to the later one.
        """
        inputs = range(self.n_inputs)
        links = [(source, target) for target in self.outputs for source in inputs]
        for node in range(self.first_hidden, self.first_hidden + self.settings.start_hidden):
            links += [(source, node) for source in [*inputs, *range(self.first_hidden, node)]]
            links += [(node, target) for target in self.outputs]
        return links

    def first_genome(self, stream: Stream) -> Genome:
        """Draws: hidden nodes where that is random; by link whether, where that is, and its weight; biases."""
        settings = self.settings
        reach = settings.initial_weight
        is_random = settings.start_topology == "random"
        n_hidden = settings.start_hidden
        if is_random:
            n_hidden = stream.below(n_hidden + 1)
        end = self.first_hidden + n_hidden
        genome = Genome()
        for number, link in enumerate(self.first_links()):
            if max(link) >= end or (min(link) >= self.first_hidden and not is_random):
                continue
            direct = link[0] < self.n_inputs and link[1] in self.outputs
            if settings.start_topology == "layer" and direct and link[0] != self.bias_input:
                continue
            if not is_random or stream.chance(0.3):
                genome.genes[number] = Gene(*link, stream.signed(reach))
        for node in range(self.n_inputs, end):
            genome.biases[node] = stream.signed(reach) if settings.node_bias else 0.0
        return genome

    # mutation

    def mutate(self, genome: Genome, history: History, stream: Stream) -> None:
        """Draws: node, link, weights, re-enabling; each first whether, then what."""
        settings = self.settings
        only_one = settings.structural_mutations == "one"
        changed = stream.chance(settings.add_node) and self.add_node(genome, history, stream)
        wants_link = stream.chance(settings.add_link)
        if wants_link and not (only_one and changed):
            changed = self.add_link(genome, history, stream) or changed
        if only_one and changed:
            return
        if stream.chance(settings.mutate_weights):
            self.mutate_weights(genome, stream)
        if stream.chance(settings.reenable):
            disabled = [number for number, gene in genome.genes.items() if not gene.enabled]
            if disabled:
                genome.genes[min(disabled)].enabled = True

    def splittable(self, genome: Genome) -> list[int]:
        return [
            number
            for number, gene in sorted(genome.genes.items())
            if gene.enabled and (self.settings.split_bias_links or gene.source != self.bias_input)
        ]

    def add_node(self, genome: Genome, history: History, stream: Stream) -> bool:
        choice = self.splittable(genome)
        if not choice:
            return False
        number = choice[stream.below(len(choice))]
        old = genome.genes[number]
        node, into = history.split(number)
        old.enabled = False
        genome.biases[node] = 0.0
        genome.genes[into] = Gene(old.source, node, 1.0)
        genome.genes[into + 1] = Gene(node, old.target, old.weight)
        return True

    def add_link(self, genome: Genome, history: History, stream: Stream) -> bool:
        """Draws for each try: source among inputs, hidden nodes, outputs; target among outputs, hidden."""
        hidden = self.hidden(genome)
        sources = [*range(self.n_inputs), *hidden, *(self.outputs if self.settings.recurrent else [])]
        targets = [*self.outputs, *hidden]
        for _ in range(self.settings.add_link_tries):
            link = (sources[stream.below(len(sources))], targets[stream.below(len(targets))])
            if link in genome.links():
                continue
            if not self.settings.recurrent and has_cycle(genome.links() | {link}):
                continue
            weight = stream.signed(self.settings.initial_weight)
            genome.genes[history.number_of_link(link)] = Gene(*link, weight)
            return True
        return False

    def mutate_weights(self, genome: Genome, stream: Stream) -> None:
        for number in sorted(genome.genes):
            gene = genome.genes[number]
            gene.weight = self.mutated(gene.weight, stream)
        if self.settings.node_bias:
            for node in sorted(genome.biases):
                genome.biases[node] = self.mutated(genome.biases[node], stream)

    def mutated(self, weight: float, stream: Stream) -> float:
        if stream.chance(self.settings.replace_weight):
            weight = stream.signed(self.settings.replaced_weight)
        else:
            weight += stream.signed(self.settings.weight_step)
        limit = self.settings.weight_limit
        return max(-limit, min(limit, weight))

    # crossover

    def crossover(self, a: Genome, b: Genome, fitness_a: float, fitness_b: float, stream: Stream) -> Genome:
        """Draws: whether to average; by gene: which parent or whether at all, whether off; biases."""
        settings = self.settings
        average = stream.chance(settings.average_weights)
        share_of_a = 1.0 if fitness_a > fitness_b else 0.0
        if fitness_a == fitness_b:
            share_of_a = 1.0 if len(a.genes) <= len(b.genes) else 0.0
            if settings.equal_parents == "mix":
                share_of_a = 0.5
        child = Genome(biases=dict.fromkeys(self.outputs, 0.0))
        for number in sorted(a.genes.keys() | b.genes.keys()):
            genes = [parent.genes[number] for parent in (a, b) if number in parent.genes]
            if len(genes) == 2:
                chosen = copy.copy(genes[0] if stream.chance(0.5) else genes[1])
                if average:
                    chosen.weight = (genes[0].weight + genes[1].weight) / 2
            else:
                share = share_of_a if number in a.genes else 1.0 - share_of_a
                if share == 0.0 or (share == 0.5 and not stream.chance(0.5)):
                    continue
                chosen = copy.copy(genes[0])
            if not all(gene.enabled for gene in genes):
                stays_off = stream.chance(settings.stay_disabled)
                chosen.enabled = not stays_off and (settings.disabled_rule == "coin" or chosen.enabled)
            if chosen.link in child.links():
                continue
            if not settings.recurrent and has_cycle(child.links() | {chosen.link}):
                continue
            child.genes[number] = chosen
            for node in chosen.link:
                if node >= self.first_hidden:
                    child.biases[node] = 0.0
        if settings.node_bias:
            for node in sorted(child.biases):
                found = [parent.biases[node] for parent in (a, b) if node in parent.biases]
                if len(found) == 2:
                    pair_mean = (found[0] + found[1]) / 2
                    child.biases[node] = (
                        pair_mean if average else found[0] if stream.chance(0.5) else found[1]
                    )
                else:
                    child.biases[node] = found[0]
        return child

    # species

    def distance(self, a: Genome, b: Genome) -> float:
        matching = sorted(a.genes.keys() & b.genes.keys())
        if not matching and self.settings.weight_coefficient:
            return math.inf
        end = min(max(a.genes), max(b.genes))
        alone = a.genes.keys() ^ b.genes.keys()
        excess = sum(number > end for number in alone)
        disjoint = len(alone) - excess
        apart = [abs(a.genes[number].weight - b.genes[number].weight) for number in matching]
        if self.settings.node_bias:
            shared = sorted(a.biases.keys() & b.biases.keys())
            apart += [abs(a.biases[node] - b.biases[node]) for node in shared]
        larger = max(len(a.genes), len(b.genes))
        smallest_normalized = {"never": math.inf, "large": 20, "always": 1}[self.settings.normalize_genes]
        size = larger if larger >= smallest_normalized else 1
        return (
            self.settings.excess_coefficient * excess / size
            + self.settings.disjoint_coefficient * disjoint / size
            + self.settings.weight_coefficient * sum(apart) / max(len(apart), 1)
        )

    def offspring(
        self,
        fitness: Sequence[float],
        species_of: Sequence[int],
        species: Sequence[Species],
        generation: int,
        improved_at: int,
    ) -> list[int]:
        """How many children each species has."""
        settings = self.settings
        members = {
            kind.identity: [f for f, of in zip(fitness, species_of, strict=True) if of == kind.identity]
            for kind in species
        }
        best = [max(members[kind.identity]) for kind in species]
        if generation - improved_at > settings.population_stagnation and len(species) > 2:
            leaders = sorted(range(len(species)), key=lambda k: -best[k])[:2]
            shares = [1.0 if k in leaders else 0.0 for k in range(len(species))]
        else:
            shares = []
            for k, kind in enumerate(species):
                own = members[kind.identity]
                share = sum(f / len(own) for f in own)
                spared = settings.best_species_spared and k == best.index(max(best))
                if generation - kind.improved >= settings.stagnation and not spared:
                    share *= settings.stagnation_factor
                shares.append(share)
        if not 0.0 < sum(shares) < math.inf:
            shares = [float(len(members[kind.identity])) for kind in species]
        return largest_remainder(shares, len(fitness))


def largest_remainder(shares: Sequence[float], total: int) -> list[int]:
    """Whole numbers in proportion to the shares; what is missing goes to the largest fractions."""
    whole = sum(shares)
    quotas = [share / whole * total for share in shares]
    counts = [math.floor(quota) for quota in quotas]
    by_fraction = sorted(range(len(shares)), key=lambda k: counts[k] - quotas[k])
    for k in by_fraction[: total - sum(counts)]:
        counts[k] += 1
    return counts


class Evolution:
    """A population from its first generation on."""

    def __init__(self, neat: Neat, key: int, replicate: int = 0) -> None:
        self.neat = neat
        self.key, self.replicate = key, replicate
        self.generation = 0
        self.history = neat.history()
        n = neat.settings.population
        self.genomes = [neat.first_genome(self.stream(0, row, GENOME)) for row in range(n)]
        self.parents = [(-1, -1)] * n
        self.species: list[Species] = []
        self.species_of: list[int] = []
        self.next_identity = 0
        self.threshold = neat.settings.threshold
        self.best_ever = -math.inf
        self.improved_at = 0
        self.place(self.genomes, [])

    def stream(self, generation: int, individual: int, purpose: int) -> Stream:
        return Stream(self.key, self.replicate, generation, individual, purpose)

    def place(self, children: list[Genome], fitness: Sequence[float]) -> None:
        """Put the children, who are of generation `self.generation`, into species."""
        settings = self.neat.settings
        kinds = list(self.species)
        stands_for = []
        for k, kind in enumerate(kinds):
            rows = [row for row, of in enumerate(self.species_of) if of == kind.identity]
            if settings.representative == "champion":
                chosen = max(rows, key=lambda row: fitness[row])
            else:
                chosen = rows[self.stream(self.generation, k, SPECIES).below(len(rows))]
            stands_for.append(self.genomes[chosen])
        species_of = []
        for child in children:
            distances = [self.neat.distance(child, genome) for genome in stands_for]
            compatible = [k for k, distance in enumerate(distances) if distance < self.threshold]
            if not compatible:
                kinds.append(Species(self.next_identity, self.generation))
                stands_for.append(child)
                self.next_identity += 1
                home = len(kinds) - 1
            elif settings.assign == "first":
                home = compatible[0]
            else:
                home = min(compatible, key=lambda k: distances[k])
            species_of.append(kinds[home].identity)
        self.species = [kind for kind in kinds if kind.identity in species_of]
        self.species_of = species_of
        self.genomes = children
        aim = settings.target_species
        if aim:
            way = (len(self.species) > aim) - (len(self.species) < aim)
            self.threshold = max(0.3, self.threshold + way * settings.threshold_step)

    def tell(self, fitness: Sequence[float]) -> None:
        settings = self.neat.settings
        self.note(fitness)
        if settings.negative_fitness == "clip":
            shared = [f if f >= 0.0 else 0.0001 for f in fitness]
        else:
            shared = [f - min(0.0, *fitness) for f in fitness]
        counts = self.neat.offspring(shared, self.species_of, self.species, self.generation, self.improved_at)
        self.history.forget()
        children: list[Genome] = []
        self.parents = []
        for kind, count in zip(self.species, counts, strict=True):
            rows = [row for row, of in enumerate(self.species_of) if of == kind.identity]
            rows.sort(key=lambda row: -fitness[row])
            counted = len(rows) if settings.champion_counts == "members" else count
            for nth in range(count):
                if nth == 0 and counted >= settings.champion_from:
                    children.append(copy.deepcopy(self.genomes[rows[0]]))
                    self.parents.append((rows[0], -1))
                else:
                    children.append(self.child(rows, kind, fitness, len(children)))
        self.generation += 1
        self.place(children, fitness)

    def note(self, fitness: Sequence[float]) -> None:
        """Who has got better."""
        for kind in self.species:
            best = max(f for f, of in zip(fitness, self.species_of, strict=True) if of == kind.identity)
            if best > kind.best:
                kind.best, kind.improved = best, self.generation
        if max(fitness) > self.best_ever:
            self.best_ever, self.improved_at = max(fitness), self.generation

    def child(self, rows: list[int], kind: Species, fitness: Sequence[float], number: int) -> Genome:
        """Draws: first parent, whether two, whether of another species, which, second parent."""
        settings, neat = self.neat.settings, self.neat
        stream = self.stream(self.generation + 1, number, CHILD)
        allowed = rows[: math.floor(settings.survival * len(rows) + 1)]
        first = second = allowed[stream.below(len(allowed))]
        if stream.chance(settings.crossover):
            others = [other for other in self.species if other is not kind]
            if others and stream.chance(settings.interspecies):
                other = others[stream.below(len(others))]
                rivals = [row for row, of in enumerate(self.species_of) if of == other.identity]
                second = max(rivals, key=lambda row: fitness[row])
            else:
                second = allowed[stream.below(len(allowed))]
        if second == first:
            self.parents.append((first, -1))
            child = copy.deepcopy(self.genomes[first])
            neat.mutate(child, self.history, stream)
            return child
        self.parents.append((first, second))
        a, b = self.genomes[first], self.genomes[second]
        child = neat.crossover(a, b, fitness[first], fitness[second], stream)
        if not stream.chance(settings.crossover_only):
            neat.mutate(child, self.history, stream)
        return child


# networks


def squash(settings: NeatSettings, total: float) -> float:
    x = settings.activation_slope * total
    if settings.activation == "tanh":
        return math.tanh(x)
    if settings.activation == "sigmoid":
        return 1.0 / (1.0 + math.exp(-x)) if x > -700 else 0.0
    return total


def feed_forward(neat: Neat, genome: Genome, inputs: Sequence[float]) -> list[float]:
    """Outputs; each node asks those before it."""

    def value(node: int) -> float:
        if node < neat.n_inputs:
            return inputs[node]
        into = [gene for gene in genome.enabled() if gene.target == node]
        total = genome.biases[node] + sum(gene.weight * value(gene.source) for gene in into)
        return squash(neat.settings, total)

    return [value(node) for node in neat.outputs]


class Recurrent:
    """A network in which all nodes change at once, from the inputs of now and the nodes of before."""

    def __init__(self, neat: Neat, genome: Genome) -> None:
        self.neat, self.genome = neat, genome
        self.state = dict.fromkeys(genome.biases, 0.0)

    def step(self, inputs: Sequence[float]) -> list[float]:
        seen = self.state | dict(enumerate(inputs))
        total = dict(self.genome.biases)
        for gene in self.genome.enabled():
            total[gene.target] += gene.weight * seen[gene.source]
        self.state = {node: squash(self.neat.settings, value) for node, value in total.items()}
        return [self.state[node] for node in self.neat.outputs]
