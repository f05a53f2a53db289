"""`python -m realitygap`."""

from realitygap.cli import main

if __name__ == "__main__":
    main()
