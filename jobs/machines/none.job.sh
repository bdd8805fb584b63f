#!/bin/bash
## submit: bash
## No batch system: a plain shell script.
# {{about}}
{{include start.part.sh}}

go_on() {
    echo "job: not done yet; start the script again and it goes on from the checkpoint"
    exit 5
}
{{include run.part.sh}}
