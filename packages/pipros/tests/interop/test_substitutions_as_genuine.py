"""`$(…)`, above all `$(eval …)`, has the same results as in genuine roslaunch."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from tests.support.ros import RosSystem, Side

PROGRAM = Path(__file__).parent / "programs" / "examine_substitutions.py"

TEXTS = """\
plain $x $ ( ) text
$(arg a)/$(arg s)
$(find roslib)$(find rospy)
$(optenv NOPE a  b)
$(dirname)/..
$(eval a + 1)
$(eval arg('a') * 2)
$(eval not b)
$(eval b and a > 2)
$(eval n * -2)
$(eval empty == '')
$(eval numbers)
$(eval optenv('NOPE', 0))
$(eval optenv('NOPE', 0) + 1)
$(eval optenv('NOPE', 'x') + 'y')
$(eval optenv('NOPE'))
$(eval env('PATH')[:0] + 'p')
$(eval dirname() + '/z')
$(eval s.lower())
$(eval s.upper() + '!')
$(eval s.title())
$(eval s.capitalize().swapcase())
$(eval '  x '.strip() + '|')
$(eval ' x '.lstrip() + ' x '.rstrip() + '|')
$(eval s.split())
$(eval s.split(' ')[1])
$(eval 'a,b,c'.split(',', 1))
$(eval 'a,b,c'.rsplit(',', 1))
$(eval 'a-b'.partition('-'))
$(eval path.rpartition('/')[2])
$(eval path.replace('.bag', '.csv'))
$(eval path.replace('/', '-', 1))
$(eval '-'.join(['x', 'y']))
$(eval '-'.join(s.split()))
$(eval path.startswith('/x') and path.endswith('.bag'))
$(eval s.startswith(('x', 'h')))
$(eval s.find('there') + s.rfind('h'))
$(eval s.index('t') + s.count('e'))
$(eval 'no'.find('z'))
$(eval '7'.zfill(3))
$(eval 'x'.center(7, '*') + 'x'.ljust(3) + 'x'.rjust(3))
$(eval '12'.isdigit() and 'ab'.isalpha() and 'a1'.isalnum())
$(eval 'AB'.isupper() or 'ab'.islower())
$(eval ' '.isspace())
$(eval '{}/{}'.format(s, a))
$(eval '{1}-{0}'.format(s, a))
$(eval '{x:>5}|{x:<5}|{x:^5}'.format(x=a))
$(eval '{:.2f}'.format(n))
$(eval '{0[1]}'.format([1, 2]))
$(eval '{0!r:>6}'.format('x'))
$(eval '{:{}}'.format(a, 4))
$(eval '{{{}}}'.format(a))
$(eval '%s_%02d' % (s, a))
$(eval {'x': 1}.get('x', 2))
$(eval {'x': 1}.get('y', 2))
$(eval {'x': 1}.get('y'))
$(eval sorted({'x': 1, 'a': 2}.keys()))
$(eval list({'x': 1}.items()))
$(eval list({'x': 1}.values()))
$(eval {'sim': 'gazebo', 'real': 'driver'}['sim'])
$(eval [1, 2, 1].count(1) + [1, 2].index(2))
$(eval list(map(float, '1 2'.split())))
$(eval list(map(int, ['1', '2'])))
$(eval sum(map(float, '1 2'.split())))
$(eval ','.join(map(str, [1, 2.5])))
$(eval [x * 2 for x in [1, 2, 3]])
$(eval [x for x in range(5) if x % 2])
$(eval [x + y for x in [1, 2] for y in [10, 20]])
$(eval [[y for y in range(x)] for x in range(3)])
$(eval {x: x * x for x in range(3)})
$(eval sorted({x % 2 for x in range(5)}))
$(eval sum(x for x in range(4)))
$(eval any(c.isdigit() for c in 'a1'))
$(eval all([c.isdigit() for c in 'a1']))
$(eval ' '.join(c.upper() for c in s.split()))
$(eval [k + v for k, v in [('a', 'b'), ('c', 'd')]])
$(eval dict((k, len(k)) for k in ['a', 'bb']))
$(eval sorted(['bb', 'a'], key=len))
$(eval max(['bb', 'a'], key=len))
$(eval [i + c for i, c in enumerate([1, 2])])
$(eval list(reversed([1, 2])))
$(eval list(zip('ab', [1, 2])))
$(eval list(filter(None, [0, 1])))
$(eval sqrt(16) + pi * 0)
$(eval int(ceil(2.1)))
$(eval round(degrees(pi)))
$(eval str(a) + 'x' if b else 'no')
$(eval float('1e3'))
$(eval int('ff', 16))
$(eval bool(a) and True and true)
$(eval len(s) - len(s.split()))
$(eval min(1, 2) + max(3, 4) + abs(-1))
$(eval a in [1, 2, 3])
$(eval 'hi' in s)
$(eval s[::-1])
$(eval s[0:2] + s[-1])
$(eval (1, 2) + (3,))
$(eval a if a > 5 else -a)
$(eval 7 // 2 * 2 ** 3 % 5)
$(eval 1 < a < 5)
$(eval nope)
$(eval 1 / 0)
$(eval s.nope())
$(eval a.b)
$(eval int('x'))
$(eval [][0])
$(eval {}['x'])
$(eval 1 +)
$(eval ''.join([1]))
$(eval 'abc'.index('z'))
$(eval '{}'.format())
$(eval [x for x in 5])
$(eval [x for x, y in [(1, 2, 3)]])
$(eval __import__('os'))
$(arg nope)
$(env NOPE_NOPE)
$(nope x)
$(find nope_nope_nope)
$(arg a b)
$(arg)
""".splitlines()


def outcomes(side: Side) -> list[dict[str, Any]]:
    texts = side.home / "texts.txt"
    texts.write_text("\n".join(TEXTS))
    ended = side.run("python3", PROGRAM, texts)
    assert ended.returncode == 0, ended.output
    return [json.loads(line) for line in ended.stdout]


def test_each_text_has_the_same_result_as_in_genuine_ros(ros: RosSystem) -> None:
    """Errors must occur on both sides; their classes are compared only if scripts catch them."""
    ours, genuine = outcomes(ros.pipros), outcomes(ros.genuine)
    share = "/usr/share/"
    different = []
    for text, own, theirs in zip(TEXTS, ours, genuine, strict=True):
        if "find" in text and "result" in theirs and share in theirs["result"]:
            continue  # packages of pipros are elsewhere
        if ("error" in own) != ("error" in theirs) or own.get("result") != theirs.get("result"):
            different.append((text, own, theirs))
    assert different == []
