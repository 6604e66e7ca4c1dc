"""python -m nocdyn_report.report"""

from .command import main

main()
