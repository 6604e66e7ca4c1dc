"""python -m nocdyn_report.report"""

import sys

try:
    from .command import main  # takes a second, in which it may be interrupted too
except KeyboardInterrupt:
    print("scripts/report: interrupted; there is no new report", file=sys.stderr)
    sys.exit(130)

main()
