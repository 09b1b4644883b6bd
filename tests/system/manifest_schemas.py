"""What may stand in the manifests of tools/cluster, as JSON Schemas: of the kinds that are used, the fields that are used, and no others.

Kubernetes publishes its schema, and Compose its own, but neither is a Debian package; so these are written by hand after
the API references (Kubernetes v1.30, the Compose Specification). They are narrower than those: a field that is misspelt, misplaced or
of a wrong type is refused, and so is a right one that no manifest needed so far. They do not know what a cluster would.
"""


def fields(required=(), **properties):
    """A map of these fields and no others. A trailing underscore keeps a name out of Python's way."""
    properties = {name.rstrip("_").replace("__", "/"): schema for name, schema in properties.items()}
    return {"type": "object", "properties": properties, "required": list(required), "additionalProperties": False}


def items(schema, least=1):
    return {"type": "array", "items": schema, "minItems": least}


def one_of(*values):
    return {"enum": list(values)}


TEXT = {"type": "string", "minLength": 1}
NUMBER = {"type": "integer", "minimum": 0}
FLAG = {"type": "boolean"}
NAME = {"type": "string", "pattern": "^[a-z0-9]([-a-z0-9.]{0,251}[a-z0-9])?$"}  # RFC 1123
PORT = {"type": "integer", "minimum": 1, "maximum": 65535}
PATH = {"type": "string", "pattern": "^/"}
QUANTITY = {"type": "string", "pattern": r"^[0-9]+(\.[0-9]+)?(m|k|Ki|M|Mi|G|Gi|T|Ti)?$"}
LABELS = {"type": "object", "additionalProperties": {"type": "string", "maxLength": 63}, "minProperties": 1}

# ---- Kubernetes.
METADATA = fields(["name"], name=NAME, labels=LABELS)
MOUNT = fields(["name", "mountPath"], name=NAME, mountPath=PATH, readOnly=FLAG)
RESOURCES = fields(requests=fields(cpu=QUANTITY, memory=QUANTITY, storage=QUANTITY), limits=fields(cpu=QUANTITY, memory=QUANTITY))
CONTAINER = fields(["name", "image", "command"], name=NAME, image=TEXT, command=items(TEXT), args=items(TEXT),
                   ports=items(fields(["name", "containerPort"], name={"type": "string", "maxLength": 15}, containerPort=PORT)),
                   resources=RESOURCES, volumeMounts=items(MOUNT))
VOLUME = {"allOf": [
    fields(["name"], name=NAME, secret=fields(["secretName"], secretName=NAME),
           emptyDir=fields(medium=one_of("Memory"), sizeLimit=QUANTITY), persistentVolumeClaim=fields(["claimName"], claimName=NAME)),
    {"minProperties": 2, "maxProperties": 2}]}  # Exactly one source.


def pod_template(*restart_policies):
    spec = fields(["containers"] + (["restartPolicy"] if "Always" not in restart_policies else []),
                  restartPolicy=one_of(*restart_policies), terminationGracePeriodSeconds=NUMBER,
                  securityContext=fields(runAsNonRoot=FLAG, runAsUser=NUMBER, fsGroup=NUMBER), initContainers=items(CONTAINER),
                  containers=items(CONTAINER), volumes=items(VOLUME))
    return fields(["metadata", "spec"], metadata=fields(["labels"], labels=LABELS, annotations=LABELS), spec=spec)


def kind(version, name, metadata=METADATA, **properties):
    return fields(["apiVersion", "kind", "metadata", *properties], apiVersion=one_of(version), kind=one_of(name), metadata=metadata,
                  **properties)


KINDS = {
    "Deployment": kind("apps/v1", "Deployment", spec=fields(
        ["selector", "template"], replicas=NUMBER, selector=fields(["matchLabels"], matchLabels=LABELS),
        template=pod_template("Always"))),
    "Job": kind("batch/v1", "Job", spec=fields(
        ["template"], backoffLimit=NUMBER, template=pod_template("OnFailure", "Never"))),
    "Service": kind("v1", "Service", spec=fields(
        ["selector", "ports"], clusterIP=one_of("None"), selector=LABELS,
        ports=items(fields(["name", "port"], name=NAME, port=PORT, targetPort=TEXT)))),
    "PersistentVolumeClaim": kind("v1", "PersistentVolumeClaim", spec=fields(
        ["accessModes", "resources"], accessModes=items(one_of("ReadWriteOnce", "ReadWriteMany")), resources=RESOURCES)),
    "HorizontalPodAutoscaler": kind("autoscaling/v2", "HorizontalPodAutoscaler", spec=fields(
        ["scaleTargetRef", "maxReplicas", "metrics"],
        scaleTargetRef=fields(["apiVersion", "kind", "name"], apiVersion=one_of("apps/v1"), kind=one_of("Deployment"), name=NAME),
        minReplicas=NUMBER, maxReplicas=NUMBER,
        metrics=items(fields(["type", "external"], type=one_of("External"), external=fields(
            ["metric", "target"], metric=fields(["name"], name=TEXT),
            target=fields(["type", "value"], type=one_of("Value"), value=QUANTITY)))),
        behavior=fields(scaleUp=fields(stabilizationWindowSeconds=NUMBER), scaleDown=fields(stabilizationWindowSeconds=NUMBER)))),
    "Kustomization": fields(
        ["apiVersion", "kind", "resources"], apiVersion=one_of("kustomize.config.k8s.io/v1beta1"), kind=one_of("Kustomization"),
        resources=items(TEXT), secretGenerator=items(fields(["name", "files"], name=NAME, files=items(TEXT))),
        images=items(fields(["name", "newName", "newTag"], name=NAME, newName=TEXT, newTag=TEXT))),
}

# ---- Compose.
DURATION = {"type": "string", "pattern": "^[0-9]+(ms|s|m|h)$"}
SERVICE = fields(
    ["image"], image=TEXT, entrypoint=items(TEXT), command=items(TEXT), restart=one_of("no", "always", "on-failure", "unless-stopped"),
    stop_grace_period=DURATION, expose=items({"type": "string", "pattern": "^[0-9]+$"}),
    ports=items({"type": "string", "pattern": r"^127\.0\.0\.1:[0-9]+:[0-9]+$"}),  # Ours are open to this machine only.
    deploy=fields(replicas=NUMBER), tmpfs=items(PATH),
    volumes=items(fields(["type", "source", "target"], type=one_of("bind", "volume"), source=TEXT, target=PATH, read_only=FLAG)),
    secrets=items(fields(["source", "target"], source=TEXT, target=TEXT, mode=NUMBER)),
    configs=items(fields(["source", "target"], source=TEXT, target=PATH)))
COMPOSE = fields(
    ["services"], name=NAME, services={"type": "object", "additionalProperties": SERVICE, "minProperties": 1},
    configs={"type": "object", "additionalProperties": fields(["content"], content=TEXT)},
    secrets={"type": "object", "additionalProperties": fields(["file"], file=TEXT)})
